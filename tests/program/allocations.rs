//! Whichever allocation of GPU memory fails, a render ends in the same way: with exit status 4, one
//! sentence, no file, and nothing left alive on the device.
//!
//! What validation sees of that are the objects and the memory that are still there when the device
//! is destroyed; the scene needs every resource that there is, so that each gets its turn.

use crate::{Folder, ended, text};

/// More than a render has.
const MOST_ALLOCATIONS: usize = 100;

fn fails_cleanly(arguments: &str) {
    let folder = Folder::new();
    let before = folder.names();
    for n in 0..MOST_ALLOCATIONS {
        let mut command = folder.isolume(arguments);
        let output = ended(command.env("ISOLUME_FAIL_ALLOCATION", n.to_string()));
        let said = text(&output.stderr);
        if output.status.success() {
            assert!(n > 20, "only {n} allocations could fail: {output:?}");
            assert!(folder.names().len() > before.len());
            return;
        }
        assert_eq!(output.status.code(), Some(4), "allocation {n}: {said}");
        assert!(
            said.starts_with("isolume: ") && said.contains("could not be allocated on "),
            "allocation {n}: {said}"
        );
        assert_eq!(said.lines().count(), 1, "allocation {n}: {said}");
        assert!(output.stdout.is_empty(), "allocation {n}: {output:?}");
        assert_eq!(folder.names(), before, "allocation {n}: {said}");
    }
    panic!("still failing after {MOST_ALLOCATIONS} allocations");
}

#[test]
fn any_allocation_may_fail() {
    fails_cleanly(
        "render ball.toml --variant caching --set surfaces.light=full --spp 1 \
         -o a.exr -o a.png --stats s.json --profile p.json",
    );
}
