// Paths that read no cache.

vec3 albedo_at(Path path) {
    return albedo_of(path.value);
}

bool collect(inout Path path, inout Random random) {
    return false;
}
