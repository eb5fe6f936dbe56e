// Loops, and how much of them a thread has run. Short loops whose turns are known, such as those over suns or over the voxels
// of a cell, are plain `for` loops and are not counted.

// Iterations of this thread's loops so far. They bound a dispatch, since they determine its time and lavapipe silently ends
// every loop of a thread group after LAVAPIPE_ITERATIONS of them. Work that takes as long as several iterations, such as a
// read of the volume or a search for surfaces in a cell, is counted as several. On a GPU, the last turn of a loop is not
// counted: the count is a lower bound.
uint iterations = 0u;

// The head of a loop that is left by `break` at its end. A CPU's driver executes the body as long as any lane of a vector
// is in the loop, so a loop that tests at its beginning costs one more body. In a loop with a single exit, that driver also
// gives lanes that have left the values of the last iteration; the condition, which always holds, is a second exit that
// prevents this. On a GPU there is no condition: from two such loops, one in the other, NVIDIA's compiler (580.159) makes
// code by which some rays miss surfaces (`transport caching::agreement` saw it).
#ifdef IS_SOFTWARE
#define LOOP while (++iterations != 0u)
#else
#define LOOP for (;; ++iterations)
#endif
