//! Shards and checkpoints: an input is an EXR, which is merged with another shard and opened as a checkpoint.

#![no_main]

use std::sync::LazyLock;

use isolume::Stop;
use isolume::shard::{Found, Manner, Named, merge};
use isolume_fuzz::{folder, guard, pictures, shards, target};

static OTHER: LazyLock<std::path::PathBuf> =
    LazyLock::new(|| folder::write("b.exr", &shards::shard(4, 8, false)));

fn seeds() -> Vec<Vec<u8>> {
    LazyLock::force(&OTHER);
    vec![
        shards::shard(0, 4, true),
        shards::shard(8, 12, false),
        shards::checkpoint(4),
    ]
}

fn parse(bytes: &[u8]) {
    let path = folder::write("a.exr", bytes);
    let allowed = 4 * pictures::allowed(bytes.len());
    let paths = [path.clone(), OTHER.clone()];
    let merged = guard::run(allowed, || merge(&paths));
    if let Ok(merged) = merged {
        let [width, height] = merged.header.identity.size;
        assert_eq!(merged.picture.rgb.len(), width as usize * height as usize);
        assert!(merged.header.count() > 4);
    }
    let _ = guard::run(allowed, || merge(&paths[..1]));
    guard::run(allowed, || {
        let Ok(found) = Found::open(&path, false) else {
            return;
        };
        let identity = shards::identity();
        let named = Named {
            name: "this",
            identity: &identity,
            scene: "",
        };
        let _ = found.check(&named, &named, &Stop::default(), &Manner::default(), 1);
        found.is_filled();
    });
}

target!(seeds, parse);
