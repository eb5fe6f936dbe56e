// Paths that read no cache.

bool collect(inout Path path, inout Random random) {
    return false;
}

bool march(inout Path path, Ray ray, inout Random random) {
    return false;
}
