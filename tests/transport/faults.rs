//! The tests can fail: one wrong line in a shader, and the check that the right text passes notices.
//!
//! `cargo test --test transport faults -- --nocapture` prints by how much.

use crate::support::common;
use crate::support::equivalence::{Limits, Picture, compare};
use crate::support::small_scenes::*;
use isolume::gpu::Shaders;
use isolume::scene::*;

/// A file of `glsl/`.
struct File {
    path: &'static str,
    text: &'static str,
}

const PATH: File = File {
    path: "include/path.glsl",
    text: include_str!("../../glsl/include/path.glsl"),
};
const PATH_SEARCH: File = File {
    path: "include/path_search.glsl",
    text: include_str!("../../glsl/include/path_search.glsl"),
};
const MEDIUM: File = File {
    path: "include/medium.glsl",
    text: include_str!("../../glsl/include/medium.glsl"),
};
const LIGHT: File = File {
    path: "include/light.glsl",
    text: include_str!("../../glsl/include/light.glsl"),
};
const PHASE: File = File {
    path: "include/phase.glsl",
    text: include_str!("../../glsl/include/phase.glsl"),
};

/// `right` is in the file; `wrong` takes its place.
struct Fault {
    name: &'static str,
    file: File,
    right: &'static str,
    wrong: &'static str,
}

impl Fault {
    fn shaders(&self) -> Shaders {
        common::shaders_with(self.file.path, self.file.text, self.right, self.wrong)
    }
}

fn assert_noticed(trial: &Trial, faults: &[Fault]) {
    let oracle = trial.oracle();
    let sound = trial.compare(&oracle, &common::shaders());
    println!("{:<36} {}", "as it is", sound.worst_image());
    let findings = sound.findings();
    assert!(findings.is_empty(), "{}: {findings:#?}", trial.name);
    for fault in faults {
        let faulty = trial.compare(&oracle, &fault.shaders());
        println!("{:<36} {}", fault.name, faulty.worst_image());
        assert!(
            !faulty.differences().is_empty(),
            "unnoticed: {}",
            fault.name
        );
    }
}

fn within_one_percent() -> Limits {
    Limits {
        tile: 8,
        image: 0.01,
        each_tile: 0.05,
        undecided: 0,
    }
}

#[test]
fn noise_is_no_proof() {
    let grey = |mean: [f64; 3], stderr: f64| Picture {
        width: 16,
        mean: vec![mean; 256],
        stderr: vec![[stderr; 3]; 256],
        runs: 16,
    };
    let against = |test: &Picture| compare(&grey([0.5; 3], 0.01), test, within(0.005));
    assert!(against(&grey([0.5; 3], 0.01)).findings().is_empty());
    let noisy = against(&grey([0.5; 3], 0.1));
    assert!(noisy.differences().is_empty() && !noisy.findings().is_empty());
    // In one channel alone.
    let blue = against(&grey([0.5, 0.5, 0.51], 0.01));
    assert!(!blue.differences().is_empty());
    let nan = against(&grey([f64::NAN; 3], 0.01));
    assert!(!nan.differences().is_empty());
}

#[test]
fn where_the_majorant_binds() {
    let mut scene = scene();
    scene.medium = Some(common::uniform_medium(0.1, 0.0, 0.0));
    let trial = Trial {
        name: "a black block",
        scene,
        volume: block([1.0; 3]),
        oracle_samples: 2000,
        gpu_samples: 2048,
        limits: within_one_percent(),
    };
    let majorant = Fault {
        name: "majorant 2 % low",
        file: MEDIUM,
        right: "return scene.density * opacity;",
        wrong: "return 0.98 * scene.density * opacity;",
    };
    assert_noticed(&trial, &[majorant]);
}

#[test]
fn in_a_medium_under_an_image_and_a_sun() {
    let mut scene = scene();
    let orange = [0.9, 0.8, 0.6];
    scene.medium = Some(medium(
        1.0,
        0.5,
        &[(10.0, 0.0, orange), (40.0, 1.0, orange)],
    ));
    scene.lights.environment.image = Some(sky_with_a_sun(4.0));
    scene.lights.suns = vec![sun([-0.5, -1.0, -0.3], [1.0, 0.9, 0.8])];
    let trial = Trial {
        name: "hills",
        scene,
        volume: hills(Storage::F32, [1.0; 3]),
        oracle_samples: 4000,
        gpu_samples: 1024,
        limits: within_one_percent(),
    };
    let faults = [
        Fault {
            name: "g → −g",
            file: PHASE,
            right: "scene.g",
            wrong: "-scene.g",
        },
        Fault {
            name: "albedo twice",
            file: PATH,
            right: "path.throughput *= albedo_of(path.value);",
            wrong: "path.throughput *= albedo_of(path.value) * albedo_of(path.value);",
        },
        Fault {
            name: "blocked light dropped",
            file: PATH,
            right: "contribute(path, path.shadow_transmittance * path.shadow_radiance);",
            // The sample is taken anew instead of counting as dark.
            wrong: "if (path.shadow_transmittance == 0.0) {
                        ++path.samples_left;
                        path.stage = STAGE_IDLE;
                        return;
                    }
                    contribute(path, path.shadow_transmittance * path.shadow_radiance);",
        },
        Fault {
            name: "faint shadow rays not made up for",
            file: PATH,
            right: "roulette(max_component(radiance / scene.cache_unit), LEAST, random);",
            wrong: "min(1.0, roulette(max_component(radiance / scene.cache_unit), LEAST, random));",
        },
        Fault {
            name: "environment mirrored",
            file: LIGHT,
            right: "environment_position(direction) * vec2(size)",
            wrong: "environment_position(vec3(-direction.x, direction.yz)) * vec2(size)",
        },
        Fault {
            name: "environment half a row off",
            file: LIGHT,
            right: "* vec2(size) - 0.5;",
            wrong: "* vec2(size) - vec2(0.5, 0.0);",
        },
        Fault {
            name: "unscattered light counted twice",
            file: PATH,
            right: "contribute(path, path.shadow_transmittance * path.shadow_radiance);",
            wrong: "contribute(path, 2.0 * path.shadow_transmittance * path.shadow_radiance);",
        },
        Fault {
            name: "no weight where two strategies meet",
            file: LIGHT,
            right: "pdf / both",
            wrong: "1.0",
        },
    ];
    assert_noticed(&trial, &faults);
}

#[test]
fn behind_half_transparent_surfaces() {
    let mut scene = scene();
    scene.surfaces.light = LightModel::Full;
    scene.surfaces.iso = vec![
        surface(20.0, 0.3, [0.8; 3], Shading::Lambert),
        surface(35.0, 1.0, [0.5; 3], Shading::Lambert),
    ];
    scene.lights.suns = vec![sun([-0.5, -1.0, -0.3], [1.0, 0.9, 0.8])];
    let trial = Trial {
        name: "veiled hills",
        scene,
        volume: hills(Storage::F32, [1.0; 3]),
        oracle_samples: 500,
        gpu_samples: 512,
        limits: within_one_percent(),
    };
    let opacity = Fault {
        name: "1 − o missing in shadow rays",
        file: PATH_SEARCH,
        right: "path.shadow_radiance *= path.shadow_transmittance;",
        wrong: "",
    };
    assert_noticed(&trial, &[opacity]);
}
