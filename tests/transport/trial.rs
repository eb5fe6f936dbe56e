//! A trial of variants that is cut short.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use isolume::engine::{Setup, Stop, Task, Trial};
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::{SceneFile, resolve};

use crate::support::common::watched_host;

/// A choice that was not made must not be kept in a checkpoint.
#[test]
fn an_interruption_leaves_it_open_which_variant_is_the_fastest() {
    let host = watched_host();
    let voxels = (0..12_u32.pow(3)).map(|n| (n * 37 % 200) as u8).collect();
    let volume = Volume::from_values([12; 3], [1.0; 3], Voxels::U8(voxels)).unwrap();
    let text = "[medium]\ntransfer = [{ value = 0.0, opacity = 0.5 }]\n[render]\nsize = [12, 10]\n";
    let file = SceneFile::parse(text, Path::new("scene.toml"), &[]).unwrap();
    let (scene, _) = resolve(&file, &volume).unwrap();
    let end = |is_interrupted: bool| {
        let interrupt = AtomicBool::new(is_interrupted);
        let task = Task {
            stop: Stop {
                relative_error: Some(0.05),
                ..Stop::default()
            },
            pictures: 1,
            interrupt: &interrupt,
        };
        let choice = host.plan(&volume, &scene).unwrap();
        let setup = Setup {
            host: &host,
            volume: &volume,
            scene: &scene,
            seed: 0,
        };
        let trial = Trial::begin(setup, choice, Some(task)).unwrap();
        assert!(trial.is_open());
        let tried = trial.end().unwrap();
        (tried.was_interrupted, tried.engine.choice().reason.clone())
    };
    let (was_interrupted, reason) = end(true);
    assert!(
        was_interrupted && reason == "it was interrupted",
        "{reason}"
    );
    let (was_interrupted, reason) = end(false);
    assert!(!was_interrupted && reason.contains("cache"), "{reason}");
}
