// The steps of a march through the medium, front to back: Σ T·(1 − exp(−σt·Δ))·albedo·light. A step is about a voxel
// long, and at most a fraction of a mean free path of the densest place nearby.
//
// A step looks at the medium in one of two ways. Even steps take its mean between the field's values at both ends, and
// have no noise: for a picture of one march. Random steps look at one place, which is random from ray to ray, and are
// right on average: for a picture that many marches make.

const float OPTICAL_DEPTH_PER_STEP = 0.5;

const float VOXELS_PER_RANDOM_STEP = 1.0;
// Shorter, since the field is curved within a voxel.
const float VOXELS_PER_EVEN_STEP = 0.75;

// Steps may be longer for a picture that is soon gone.
float step_scale = 1.0;

// 1 − exp(−x) without cancellation.
float absorbed_by(float x) {
    return x < 0.01 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0))) : 1.0 - exp(-x);
}

// A march under way, stretch by stretch: what a row of cells that hold medium has of the ray. It stands at a
// step; at its end `steps` is 0. (Stretches of one cell leave lanes waiting for their neighbours; a row without
// end would be walked through for rays that soon are opaque.)
struct March {
    float t, t_end;
    Walk walk;   // through the majorants' cells; stands behind the stretch
    bool inside; // or has left them
    float exit;  // where the stretch ends
    float size;  // of its steps
    uint steps;  // of them still to be made, from t on
    float rate;  // of steps per world length, at least
    float depth; // of the last random step; negative before the first
    Classified end; // where the next even step begins
};

const uint CELLS_PER_STRETCH = 8u;

// Goes on to the next stretch, if there is one.
void next_stretch(Ray ray, inout March march) {
    ivec3 lattice = ivec3(scene.majorant_cells);
    float majorant = 0.0;
    uint cells = 0u;
    march.t = march.exit;
    LOOP {
        float here = majorant_of(march.walk.cell);
        float exit = max(march.exit, min(march.walk.exit, march.t_end));
        bool holds_medium = march.inside && here > 0.0 && exit > march.exit;
        if (cells > 0u && !holds_medium) {
            break;
        }
        march.exit = exit;
        march.t = holds_medium ? march.t : exit;
        cells += holds_medium ? 1u : 0u;
        majorant = max(majorant, here);
        march.inside = march.walk.exit < march.t_end
                    && step_walk(march.walk, ray, scene.majorant_size, lattice);
        if (!march.inside || cells == CELLS_PER_STRETCH) {
            break;
        }
    }
    float left = march.exit - march.t;
    float rate = max(march.rate, majorant / (step_scale * OPTICAL_DEPTH_PER_STEP));
    float steps = max(1.0, ceil(left * rate - 1e-3));
    march.size = left / steps;
    march.steps = cells > 0u ? uint(steps) : 0u;
}

March begin_march(Ray ray, float t, float t_end, float voxels_per_step) {
    const Classified NONE = Classified(0.0, 0, vec4(0.0), vec4(0.0));
    Walk walk = begin_walk(ray, t, scene.majorant_size, ivec3(scene.majorant_cells));
    float rate = length(ray.step) / (step_scale * voxels_per_step);
    March march = March(t, t_end, walk, true, t, 0.0, 0u, rate, -1.0, NONE);
    next_stretch(ray, march);
    return march;
}

// A step of the march.
struct MarchStep {
    float absorbed; // 1 − exp(−optical depth)
    vec3 albedo;    // of what it meets
    float t;        // where in it
};

// Makes a step and looks at the medium at `place` in it, in [0, 1), which is the same in all steps of a ray and random
// from ray to ray: a ray's optical depth is right on average, however narrow a tent of the transfer function is. (In the
// middle of steps that begin at a cell's side, 5 % of the light of a head's skin was missed.) exp(−x) is then too large
// by half the variance of the depth x (Jensen); a quarter of the square of its change from the step before estimates that.
MarchStep make_random_step(Ray ray, inout March march, float place) {
    float t = march.t + place * march.size;
    Medium medium = medium_of(lookup(ray, t));
    float depth = medium.sigma_t * march.size;
    float change = march.depth < 0.0 ? 0.0 : depth - march.depth;
    float absorbed = absorbed_by(depth);
    march.depth = depth;
    march.t += march.size;
    --march.steps;
    return MarchStep(min(absorbed + 0.125 * change * change * (1.0 - absorbed), 1.0), medium.albedo, t);
}

// To be called where a stretch begins, before even steps through it.
void begin_even_steps(Ray ray, inout March march) {
    march.end = classify(lookup(ray, march.t));
}

// Makes a step along which the medium is that of a field which is linear from its beginning to its end: without noise,
// but where the field is curved it loses or gains light.
MarchStep make_even_step(Ray ray, inout March march) {
    Classified begin = march.end;
    float t = march.t + 0.5 * march.size;
    march.t += march.size;
    march.end = classify(lookup(ray, march.t));
    --march.steps;
    Medium medium = mean_medium(begin, march.end);
    return MarchStep(absorbed_by(medium.sigma_t * march.size), medium.albedo, t);
}

// The transmittance of [t, t_end], or 0 where it is less than `least`.
float marched_transmittance(Ray ray, float t, float t_end, float least) {
    if (!has_medium || !(t < t_end)) {
        return 1.0;
    }
    March march = begin_march(ray, t, t_end, VOXELS_PER_EVEN_STEP);
    float transmittance = 1.0;
    LOOP {
        if (march.steps == 0u) {
            break;
        }
        begin_even_steps(ray, march);
        LOOP {
            MarchStep s = make_even_step(ray, march);
            transmittance *= 1.0 - s.absorbed;
            if (march.steps == 0u || transmittance < least) {
                break;
            }
        }
        if (transmittance < least) {
            break;
        }
        next_stretch(ray, march);
    }
    return transmittance < least ? 0.0 : transmittance;
}

// What a march has taken since it last read the cache: light varies little from step to step.
struct Taken {
    vec3 albedo;  // Σ weight·albedo, if it has several colours
    float weight; // Σ T·(1 − exp(−σt·Δ))
    float t;      // Σ weight·t
    uint steps;
};

const Taken NOTHING_TAKEN = Taken(vec3(0.0), 0.0, 0.0, 0u);

// Whether it is time to read the cache: after as many steps as there are voxels between nodes, or a few
// times as many where next to nothing has been taken.
bool is_due(Taken taken) {
    const float NEXT_TO_NOTHING = 0.02;
    uint stride = taken.weight < NEXT_TO_NOTHING ? 4u * scene.cache_stride : scene.cache_stride;
    return taken.steps >= stride;
}

void take(inout Taken taken, float weight, vec3 albedo, float t) {
    ++taken.steps;
    if (!has_one_color) {
        taken.albedo += weight * albedo;
    }
    taken.weight += weight;
    taken.t += weight * t;
}

vec3 albedo_taken(Taken taken) {
    return has_one_color ? taken.weight * scene.color : taken.albedo;
}

// Where `taken` was taken, on average.
Cube cube_taken(Taken taken, Ray ray) {
    float t = taken.t / max(taken.weight, 1e-30);
    return cube_at(ray.origin + t * ray.step);
}

// What of it is scattered towards the ray's beginning, without the suns' own.
vec3 scattered_back(CachedLight light, Ray ray) {
    return max(vec3(0.0), scattered_light(light, -ray.direction));
}
