// Paths from the cache's nodes: estimates of the light that arrives there, averaged over directions.
//
// A path begins at a node, or in a film near it (node_start.glsl), as if it had just collided there in an isotropic medium:
// with a shadow ray, and in a direction that is uniform over the sphere. The path's light goes to the node's mean and flux; the
// light of the first shadow ray, if it went to a sun, goes to the suns' transmittance. Slots take parts of a node's paths from a
// queue (slot_loop.glsl, turns.glsl); merge_parts.comp adds up the parts.
//
// The first paths of a node end where they can gather light that the cache holds so far (gathering.glsl), and the
// very first are paths of only some nodes (coarse.glsl).
//
// A brick gets paths according to how much of it is seen (src/render/cache/focus.rs).

#version 460
#include "scene.glsl"
#include "cache.glsl"
#include "gathering.glsl"
#include "light.glsl"
#include "node_start.glsl"
#include "nodes.glsl"
#include "path.glsl"
#include "phase.glsl"
#include "push.glsl"
#include "random.glsl"
#include "scattered.glsl"
#include "slot_loop.glsl"
#include "slots.glsl"
#include "surface.glsl"
#include "turns.glsl"

layout(scalar) buffer SlotNodeBlock { SlotNode at[]; } slot_nodes;

// What is known of the slot's item.
SlotNode slot_node;
SlotNode held_node;

void arrive(vec3 radiance, vec3 towards_light, bool is_skys_own) {
    vec3 light = radiance / scene.cache_unit;
    slot_node.sums.light.rgb += light;
    if (has_colored_flux()) {
        slot_node.sums.flux -= outerProduct(towards_light, light);
    } else if (has_surface_fluxes && is_skys_own) {
        slot_node.sums.flux[1] -= channel_mean(light) * towards_light;
        slot_node.sums.flux[2].x += channel_mean(light);
    } else if (has_node_flux || has_surface_fluxes) {
        slot_node.sums.flux[0] -= channel_mean(light) * towards_light;
    }
}

void contribute(inout Path path, vec3 radiance) {
    if (path.bounces > 0u) {
        arrive(radiance, slot_node.first_direction, false);
    } else if (slot_node.shadow_is_sun != 0u) {
        slot_node.sums.light.a += radiance.x;
    } else {
        arrive(radiance, path.shadow_direction, true);
    }
}

void add_coverage(inout Path path, float share) {}

void escape(inout Path path) {
    arrive(path.throughput * escaping_radiance(path.direction, path.pdf),
           slot_node.first_direction, path.bounces == 0u);
}

bool end_in_cache(inout Path path, inout Random random) {
    if (slot_node.gathers == 0u) {
        return false;
    }
    Cube cube = cube_at(end_of_flight(path));
    if (is_left_to_paths(cube)) {
        return false;
    }
    CachedLight light = read_half(cube, 1 - int(push.nodes_half));
    if (!light.known) {
        return false;
    }
    vec3 towards = -path.direction;
    vec3 scattered = scattered_light(light, towards);
    // The cache holds one transmittance for all suns, which does not tell which of them it is.
    if (!suns_differ) {
        scattered += light.suns * suns_scattered(towards);
    }
    contribute(path, path.throughput * scattered);
    path.origin = end_of_flight(path);
    if (suns_differ) {
        aim_at_sun(path, random);
    }
    end_path(path);
    return true;
}

bool has_suns_already(Path path) {
    return false;
}

bool begin_item(inout Path path) {
    uint item;
    if (!next_item(first_item_of(push.turns), item)) {
        return false;
    }
    uint index = turn_of(item);
    Turn turn = turns.at[index];
    ivec3 node = node_at(index, turn.place, item - first_item_of(index));
    uvec3 lattice = scene.cache_nodes;
    path.pixel = (node.z * lattice.y + node.y) * lattice.x + node.x;
    uint most = (turn.paths + turn.parts - 1u) / turn.parts;
    uint first = turn.part * most;
    path.samples_left = is_in_lattice(node) ? min(most, turn.paths - first) : 0u;
    path.sample_index = NODE_SAMPLES + turn.paths_before + first - 1u;
    slot_node.start = node_position(node);
    slot_node.reach = path.samples_left > 0u ? reach_of(node, index < push.coarse_turns) : 0.0;
    slot_node.item = item;
    slot_node.gathers = gathers(turn, push.nodes_half) ? 1u : 0u;
    slot_node.sums = NodeSums(vec4(0.0), mat3(0.0));
    return true;
}

// Next-event estimation as at a collision. The directions' pdf on the sphere is 1/4π, and the mean
// over directions divides by 4π: for a sky, radiance over pdf and 4π; for a sun, its share.
void ask_for_light(inout Path path, inout Random random) {
    LightSample light = sample_light(words_for_light(path, random));
    vec3 radiance = light_weight(light, 0.25 / PI) * light.radiance * (0.25 / PI);
    if (light.is_sun) {
        radiance = vec3(channel_mean(light.radiance / scene.cache_unit) / scene.suns_grey);
    }
    slot_node.shadow_is_sun = light.is_sun ? 1u : 0u;
    // Without roulette: the suns' transmittance is estimated by this ray.
    aim_shadow_ray(path, light.towards, radiance, NOTHING);
}

void begin_sample(inout Path path) {
    --path.samples_left;
    ++path.sample_index;
    begin_path(path);
    Random random = random_of(path);
    if (has_tents) {
        slot_node.start = start_around(slot_node.start, slot_node.reach, random);
        slot_node.reach = 0.0;
    }
    path.origin = slot_node.start;
    if (has_light_sampling) {
        ask_for_light(path, random);
    }
    vec2 u = numbers_for_direction(path, random).xy;
    slot_node.first_direction = uniform_direction(u);
    path.pdf = 0.25 / PI;
    redirect(path, slot_node.first_direction, NOTHING, random);
    path.dimension = random.dimension;
}

void finish_item(inout Path path) {
    store_sums(slot_node.item, slot_node.sums);
}

void load_item(uint slot, Path path) {
    if (!is_idle(path)) {
        slot_node = slot_nodes.at[slot];
    }
}

void store_item(uint slot, Path path) {
    if (!is_idle(path)) {
        slot_nodes.at[slot] = slot_node;
    }
}

void hold_item() {
    held_node = slot_node;
}

void undo_item() {
    slot_node = held_node;
}
