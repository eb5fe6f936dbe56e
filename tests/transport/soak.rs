//! Renders one after the other in one process, for as long as `tools/soak` says: whatever a scene's keys are, a render gives
//! back what it took.

use std::num::NonZeroU32;

use isolume::engine::{Engine, Host, HostOptions, Stop};

use crate::edits::{CACHED, OF_CACHED, folder, scene, volume};
use crate::support::curve::{Curve, validates};

/// Edits that a scene has at most beside its own keys.
const MOST_EDITS: usize = 3;

#[test]
#[ignore = "takes as long as it is told: tools/soak"]
fn soak_of_renders() {
    let options = HostOptions {
        validation: validates(),
        ..HostOptions::default()
    };
    let host = Host::open(&options).expect("a device");
    let (folder, volume) = (folder(), volume());
    let mut random = fastrand::Rng::with_seed(21);
    let mut curve = Curve::begin("renders", std::process::id());
    let mut done = 0;
    while curve.goes_on(done) {
        // Two of one table exclude each other.
        let count = random.usize(0..=MOST_EDITS);
        let mut edits = random.choose_multiple(OF_CACHED, count);
        edits.sort();
        edits.dedup_by_key(|edit| edit.split(['.', '=']).next());
        let edits: Vec<&str> = edits.into_iter().copied().collect();
        let scene = scene(CACHED, folder.path(), &edits, &volume);
        let seed = random.u32(..);
        let mut engine = Engine::new(&host, &volume, &scene, seed).expect("an engine");
        let samples = NonZeroU32::new(random.u32(1..20)).expect("some");
        engine.render(Stop::at_samples(samples)).expect("a picture");
        engine.picture().expect("a picture");
        let memory = engine.memory_stats();
        assert_eq!(memory.peak_bytes, memory.planned_bytes, "{edits:?}");
        drop(engine);
        host.check_validation().expect("silence");
        done += 1;
    }
    curve.assert_level();
}
