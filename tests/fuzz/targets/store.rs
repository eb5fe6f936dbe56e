//! Stores: an input is the file, or its table and chunks, which get the volume's identity and right checksums.

#![no_main]

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use isolume::scene::volume::{Endian, Reading, Stores, Volume, VolumeOverrides, VoxelType};
use isolume_fuzz::tiff_files::{LZW, Tiff};
use isolume_fuzz::volume_files::Array;
use isolume_fuzz::{folder, guard, target, volume};
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: &[u8] = b"isostore";
const END_BYTES: usize = 24;
const IDENTITY_BYTES: usize = 16;
/// Of a chunk in the table: where it begins, its length, its checksum.
const ENTRY_BYTES: usize = 24;

/// A volume with a store of two chunks.
struct Genuine {
    volume: PathBuf,
    stores: Stores,
    path: PathBuf,
    chunks: Vec<u8>,
    table: Vec<u8>,
}

static GENUINE: LazyLock<Genuine> = LazyLock::new(|| {
    let array = Array::new([40, 3, 2], VoxelType::U8, Endian::Little);
    let tiff = Tiff {
        compression: LZW,
        ..Tiff::default()
    };
    let path = folder::write("v.tif", &tiff.write(&array));
    let folder = folder::empty("stores");
    let stores = Stores::new(folder.clone(), |_| Ok(()));
    open(&path, &stores).expect("a store");
    let entries = std::fs::read_dir(folder).expect("the stores");
    let store = entries.flatten().next().expect("a store").path();
    let bytes = std::fs::read(&store).expect("a store");
    let end = bytes.len() - END_BYTES;
    let length = u64::from_le_bytes(bytes[end + 8..end + 16].try_into().expect("eight bytes"));
    let (chunks, table) = bytes[..end].split_at(end - length as usize);
    Genuine {
        volume: path,
        stores,
        path: store,
        chunks: chunks.to_vec(),
        table: zstd::stream::decode_all(table).expect("a table"),
    }
});

fn open(volume: &Path, stores: &Stores) -> isolume::Result<()> {
    let overrides = VolumeOverrides::default();
    let volume = Volume::load_watched(volume, &overrides, &Reading::default(), Some(stores))?;
    let volume = volume.in_any_order()?;
    let voxels = volume.voxels()?;
    assert_eq!(voxels.len(), 40 * 3 * 2);
    volume.histogram(16)?;
    Ok(())
}

fn seeds() -> Vec<Vec<u8>> {
    let store = std::fs::read(&GENUINE.path).expect("a store");
    let table = &GENUINE.table;
    assert_is_used(&sealed(table, &GENUINE.chunks));
    let length = (table.len() as u16).to_le_bytes();
    let parts = [b"1", &length[..], table, &GENUINE.chunks].concat();
    vec![[b"0", &store[..]].concat(), parts]
}

/// The volume can be read from such a store, and it is not written anew.
fn assert_is_used(store: &[u8]) {
    let Genuine {
        volume,
        stores,
        path,
        ..
    } = &*GENUINE;
    std::fs::write(path, store).expect("a store");
    open(volume, stores).expect("a volume");
    assert!(
        std::fs::read(path).expect("a store") == store,
        "the seed is no store"
    );
}

fn parse(bytes: &[u8]) {
    let store = match bytes.split_first() {
        Some((b'0', file)) => file.to_vec(),
        Some((b'1', parts)) if parts.len() > 2 => {
            let length = usize::from(u16::from_le_bytes([parts[0], parts[1]]));
            let (table, chunks) = parts[2..].split_at(length.min(parts.len() - 2));
            sealed(table, chunks)
        }
        _ => return,
    };
    let genuine = &*GENUINE;
    std::fs::write(&genuine.path, &store).expect("a store");
    // One that is damaged is told or written anew.
    let _ = guard::run(volume::allowed_in_chunks(bytes.len()), || {
        open(&genuine.volume, &genuine.stores)
    });
}

/// A store of this volume, with right checksums.
fn sealed(table: &[u8], chunks: &[u8]) -> Vec<u8> {
    let mut table = table.to_vec();
    let identity = table.len().min(IDENTITY_BYTES);
    table[..identity].copy_from_slice(&GENUINE.table[..identity]);
    // The chunks' entries stand last.
    let (_, entries) = table.as_rchunks_mut::<ENTRY_BYTES>();
    for entry in entries.iter_mut().rev().take(2) {
        let number = |at: usize| {
            u64::from_le_bytes(entry[at..at + 8].try_into().expect("eight bytes")) as usize
        };
        let (begin, length) = (number(0), number(8));
        if let Some(chunk) = begin
            .checked_add(length)
            .and_then(|end| chunks.get(begin..end))
        {
            entry[16..].copy_from_slice(&xxh3_64(chunk).to_le_bytes());
        }
    }
    let packed = zstd::bulk::compress(&table, 1).expect("a table");
    let length = (packed.len() as u64).to_le_bytes();
    let checksum = xxh3_64(&packed).to_le_bytes();
    [chunks, &packed, MAGIC, &length, &checksum].concat()
}

target!(seeds, parse);
