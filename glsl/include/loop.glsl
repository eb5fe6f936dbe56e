// Loops, and how much of them a thread has run.

// Iterations of this thread's loops so far. A dispatch is bounded by them: they are what takes time, and lavapipe
// silently ends every loop of a thread group after LAVAPIPE_ITERATIONS of them. What takes about as long as several counts
// as so many: a read of the volume, a search for surfaces in a cell.
uint iterations = 0u;

// A loop that is left by `break` at its end. A CPU's driver runs through a loop's whole body for as long as one lane
// of its vectors has not left, so that a loop that tests at its beginning costs a body more. If a loop has a single
// exit, the driver also hands on what the last iteration computed to lanes that had left before. So the condition,
// which always holds, is a second exit there. Elsewhere there is none: from two such loops, one in the other, NVIDIA's
// compiler (580.159) makes code by which some rays miss surfaces (`transport caching::agreement` saw it).
#ifdef IS_SOFTWARE
#define LOOP while (++iterations != 0u)
#else
#define LOOP for (;; ++iterations)
#endif
