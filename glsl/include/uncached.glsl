// Paths that read no cache.

bool collect(inout Path path, inout Random random) {
    return false;
}
