// Copies bricks of the volume to their places in its image, from the buffer into which the host has read them. A copy
// command would do the same, but takes a GPU's driver several microseconds for each slice of a brick.

#version 460
#extension GL_EXT_scalar_block_layout : require
#include "shared.glsl"

layout(local_size_x = 64) in;
#include "push.glsl"
layout(scalar) readonly buffer StagingBlock { uint words[]; } staging;
layout(scalar) readonly buffer PieceBlock { BrickPiece at[]; } pieces;
layout(VOLUME_FORMAT) writeonly uniform image3D volume;

// The float that a store into an image of normalised integers turns into n, whether the device rounds or truncates.
float normalised(uint n, uint largest) {
    return min((float(n) + 0.25) / float(largest), 1.0);
}

// The texel of the voxel at this byte of the buffer.
float voxel_at(uint byte) {
    uint word = staging.words[byte / 4u] >> 8u * (byte % 4u);
    if (push.voxel_bytes == 1u) {
        return normalised(word & 0xFFu, 0xFFu);
    }
    return push.voxel_bytes == 2u ? normalised(word & 0xFFFFu, 0xFFFFu) : uintBitsToFloat(word);
}

void main() {
    BrickPiece piece = pieces.at[gl_GlobalInvocationID.y];
    uvec3 extent = piece.extent;
    uint i = gl_GlobalInvocationID.x;
    if (i >= extent.x * extent.y * extent.z) {
        return;
    }
    uvec3 voxel = uvec3(i % extent.x, i / extent.x % extent.y, i / (extent.x * extent.y));
    imageStore(volume, ivec3(piece.low + voxel), vec4(voxel_at(piece.offset + i * push.voxel_bytes)));
}
