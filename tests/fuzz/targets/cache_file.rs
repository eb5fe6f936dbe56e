//! The state of a cache beside a checkpoint: an input is the file, or its header in a file that is right otherwise.

#![no_main]

use isolume::Stop;
use isolume::shard::{Fingerprint, Found, Identity, Manner, Named};
use isolume_fuzz::{folder, guard, shards, target};

const MAGIC: &[u8] = b"isolume cache 1\n";

fn seeds() -> Vec<Vec<u8>> {
    let header = shards::cache_header().to_string().into_bytes();
    assert_opens(&file(&header));
    vec![
        [b"0", &file(&header)[..]].concat(),
        [b"1", &header[..]].concat(),
    ]
}

fn file(header: &[u8]) -> Vec<u8> {
    let state = [0; 16];
    let length = (header.len() as u64).to_le_bytes();
    sealed(&[MAGIC, &state, header, &length].concat())
}

fn sealed(body: &[u8]) -> Vec<u8> {
    [body, &Fingerprint::default().with(body).bytes()].concat()
}

fn assert_opens(cache: &[u8]) {
    let checkpoint = folder::path("a.exr");
    folder::write("a.exr.cache", cache);
    let found = Found::open(&checkpoint, false).expect("the seed is no cache");
    assert!(found.is_filled());
    let identity = shards::identity();
    found
        .check(
            &named(&identity),
            &named(&identity),
            &Stop::default(),
            &Manner::default(),
            1,
        )
        .expect("the seed belongs to another render");
}

fn named(identity: &Identity) -> Named<'_> {
    Named {
        name: "this",
        identity,
        scene: "",
    }
}

fn parse(bytes: &[u8]) {
    let cache = match bytes.split_first() {
        Some((b'0', file)) => file.to_vec(),
        Some((b'1', header)) => file(header),
        // Everything but the fingerprint.
        Some((b'2', body)) => sealed(body),
        _ => return,
    };
    let checkpoint = folder::path("a.exr");
    folder::write("a.exr.cache", &cache);
    let identity = shards::identity();
    guard::run((1 << 20) + 64 * cache.len(), || {
        let Ok(found) = Found::open(&checkpoint, false) else {
            return;
        };
        let _ = found.check(
            &named(&identity),
            &named(&identity),
            &Stop::default(),
            &Manner::default(),
            1,
        );
        found.is_filled();
        found.fill();
    });
}

target!(seeds, parse);
