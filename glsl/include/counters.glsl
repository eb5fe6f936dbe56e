// What a pass counts for the host, and where its queue stands.

#include "shared.glsl"

layout(scalar) buffer CounterBlock { Counters count; } counters;

// Takes the next of so many items from the queue; false if there is none left.
bool next_item(uint items, out uint item) {
    // Slots ask again in every dispatch until the longest path has ended: the counter must not wrap around.
    if (counters.count.next >= items) {
        return false;
    }
    item = atomicAdd(counters.count.next, 1u);
    return item < items;
}
