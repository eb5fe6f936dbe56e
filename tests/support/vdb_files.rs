//! Writes OpenVDB files of version 224, as OpenVDB's own source reads and writes them (`openvdb/io`, `openvdb/tree`).

#![allow(dead_code)] // The fuzzer uses less of it than the tests of formats.

use std::collections::BTreeMap;

use isolume::scene::volume::{Endian, VoxelType};

use crate::volume_files::{Array, zlib};
use crate::zarr_files::blosc::{Blosc, Inner};

pub const ZIP: u32 = 1;
/// Inactive values are left out.
pub const ACTIVE_MASK: u32 = 2;
pub const BLOSC: u32 = 4;

/// A voxel, a slot or a node, by its lowest voxel.
type Place = [i64; 3];

#[derive(Debug, Clone)]
pub struct Grid {
    pub name: String,
    /// The type of grid that is written, such as "float", if it is not the array's.
    pub kind: Option<&'static str>,
    /// Whether arrays are written in 16 bits.
    pub is_half: bool,
    pub compression: u32,
    pub class: &'static str,
    pub transform: Transform,
    /// Place of the array's first voxel.
    pub low: Place,
    pub background: f64,
    /// Voxels of these values are inactive.
    pub inactive: Vec<f64>,
    /// Whether leaves of one value become slots without a node.
    pub has_tiles: bool,
    /// A block of 4096³ voxels that has one value and no node, and whether it is active.
    pub block: Option<(Place, f64, bool)>,
    /// The name of the grid whose tree this one shows.
    pub parent: &'static str,
}

#[derive(Debug, Clone)]
pub enum Transform {
    /// A map's name, and the vectors that are written.
    Vectors(&'static str, Vec<[f64; 3]>),
    /// Rows.
    Affine([[f64; 4]; 4]),
}

impl Transform {
    pub fn scale(scale: [f64; 3]) -> Transform {
        Transform::Vectors("ScaleMap", vec![scale; 5])
    }

    fn write(&self, out: &mut Vec<u8>) {
        let (name, numbers): (_, Vec<f64>) = match self {
            Transform::Vectors(name, vectors) => (*name, vectors.concat()),
            Transform::Affine(rows) => ("AffineMap", rows.concat()),
        };
        text(out, name);
        out.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    }
}

impl Default for Grid {
    fn default() -> Grid {
        Grid {
            name: "density".into(),
            kind: None,
            is_half: false,
            compression: BLOSC | ACTIVE_MASK,
            class: "fog volume",
            transform: Transform::scale([1.0; 3]),
            low: [0; 3],
            background: 0.0,
            inactive: Vec::new(),
            has_tiles: false,
            block: None,
            parent: "",
        }
    }
}

/// A file with an array for each grid.
pub fn write(grids: &[(Grid, &Array)]) -> Vec<u8> {
    let mut out = head(224, true);
    out.extend((grids.len() as u32).to_le_bytes());
    for (grid, array) in grids {
        grid.write(array, &mut out);
    }
    out
}

/// What stands before the list of grids.
pub fn head(version: u32, has_offsets: bool) -> Vec<u8> {
    let mut out = 0x5644_4220_u64.to_le_bytes().to_vec();
    for number in [version, 10, 0] {
        out.extend(number.to_le_bytes());
    }
    out.push(has_offsets.into());
    out.extend([b'0'; 36]);
    out.extend(1_u32.to_le_bytes());
    metadata(&mut out, "creator", "nobody");
    out
}

fn text(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}

fn metadata(out: &mut Vec<u8>, name: &str, value: &str) {
    text(out, name);
    text(out, "string");
    text(out, value);
}

fn place(out: &mut Vec<u8>, place: Place) {
    out.extend(place.iter().flat_map(|index| (*index as i32).to_le_bytes()));
}

/// The voxels of a leaf, z fastest, and which of them are active.
#[derive(Clone)]
struct Leaf {
    values: Vec<f64>,
    active: Vec<bool>,
}

/// Leaves of one value and state that became slots have `None`, and their value and state.
type Slots = BTreeMap<Place, (Option<Leaf>, f64, bool)>;

impl Grid {
    fn write(&self, array: &Array, out: &mut Vec<u8>) {
        text(out, &self.name);
        let kind = self.kind.unwrap_or(match array.voxel_type {
            VoxelType::F16 => "half",
            VoxelType::F64 => "double",
            VoxelType::I32 => "int32",
            VoxelType::I64 => "int64",
            _ => "float",
        });
        let suffix = if self.is_half { "_HalfFloat" } else { "" };
        text(out, &format!("Tree_{kind}_5_4_3{suffix}"));
        text(out, self.parent);
        let offsets = out.len();
        out.extend([0; 24]);
        let begin = out.len();
        out.extend(self.compression.to_le_bytes());
        out.extend(1_u32.to_le_bytes());
        metadata(out, "class", self.class);
        self.transform.write(out);
        let mut leaves = out.len();
        if self.parent.is_empty() {
            leaves = self.tree(array, out);
        }
        for (n, offset) in [begin, leaves, out.len()].into_iter().enumerate() {
            out[offsets + 8 * n..][..8].copy_from_slice(&(offset as u64).to_le_bytes());
        }
    }

    /// Writes the nodes and the leaves, and returns the offset of these.
    fn tree(&self, array: &Array, out: &mut Vec<u8>) -> usize {
        let slots = self.slots(array);
        out.extend(1_u32.to_le_bytes());
        out.extend(numbers(array.voxel_type, &[self.background]));
        let mut blocks: BTreeMap<Place, BTreeMap<Place, Slots>> = BTreeMap::new();
        for (low, slot) in slots {
            let of = |side: i64| low.map(|index| index.div_euclid(side) * side);
            let block = blocks.entry(of(4096)).or_default();
            block.entry(of(128)).or_default().insert(low, slot);
        }
        out.extend(u32::from(self.block.is_some()).to_le_bytes());
        out.extend((blocks.len() as u32).to_le_bytes());
        if let Some((low, value, is_active)) = self.block {
            place(out, low);
            out.extend(numbers(array.voxel_type, &[value]));
            out.push(is_active.into());
        }
        for (low, block) in &mut blocks {
            place(out, *low);
            let mut active = vec![false; 32 * 32 * 32];
            let mut values = vec![self.background; active.len()];
            block.retain(|place, slots| {
                let tile = of_one_value(slots);
                if let Some((value, is_active)) = tile {
                    let slot = slot(32, *low, 128, place);
                    (active[slot], values[slot]) = (is_active, value);
                }
                tile.is_none()
            });
            let children = bits(32, *low, 128, block.keys());
            out.extend(packed_bits(&children));
            out.extend(packed_bits(&active));
            self.pack(array, &values, &active, &children, out);
            for (low, slots) in block {
                self.lower(array, *low, slots, out);
            }
        }
        let leaves = out.len();
        for slots in blocks.values().flat_map(BTreeMap::values) {
            for leaf in slots.values().filter_map(|(leaf, ..)| leaf.as_ref()) {
                out.extend(packed_bits(&leaf.active));
                self.pack(array, &leaf.values, &leaf.active, &[false; 512], out);
            }
        }
        leaves
    }

    fn lower(&self, array: &Array, low: Place, slots: &Slots, out: &mut Vec<u8>) {
        let of = |wanted: fn(&(Option<Leaf>, f64, bool)) -> bool| {
            let found = slots.iter().filter(|(_, slot)| wanted(slot));
            bits(16, low, 8, found.map(|(low, _)| low))
        };
        let children = of(|(leaf, ..)| leaf.is_some());
        let active = of(|(leaf, _, is_active)| leaf.is_none() && *is_active);
        out.extend(packed_bits(&children));
        out.extend(packed_bits(&active));
        let mut values = vec![self.background; children.len()];
        for (place, (_, value, _)) in slots.iter().filter(|(_, (leaf, ..))| leaf.is_none()) {
            values[slot(16, low, 8, place)] = *value;
        }
        self.pack(array, &values, &active, &children, out);
        for leaf in slots.values().filter_map(|(leaf, ..)| leaf.as_ref()) {
            out.extend(packed_bits(&leaf.active));
        }
    }

    fn slots(&self, array: &Array) -> Slots {
        let mut leaves: BTreeMap<Place, Leaf> = BTreeMap::new();
        let [width, height, _] = array.dims.map(|size| size as usize);
        for (n, value) in array.values.iter().enumerate() {
            let within = [n % width, n / width % height, n / width / height];
            let voxel: Place = std::array::from_fn(|a| self.low[a] + within[a] as i64);
            let low = voxel.map(|index| index.div_euclid(8) * 8);
            let leaf = leaves.entry(low).or_insert_with(|| Leaf {
                values: vec![self.background; 512],
                active: vec![false; 512],
            });
            let at = slot(8, low, 1, &voxel);
            leaf.values[at] = *value;
            leaf.active[at] = !self.inactive.contains(value);
        }
        let slot_of = |(low, leaf): (Place, Leaf)| {
            let (value, is_active) = (leaf.values[0], leaf.active[0]);
            let is_one = leaf.values.iter().all(|other| *other == value)
                && leaf.active.iter().all(|other| *other == is_active);
            let leaf = (!self.has_tiles || !is_one).then_some(leaf);
            (low, (leaf, value, is_active))
        };
        leaves.into_iter().map(slot_of).collect()
    }

    /// The values of a node's slots.
    fn pack(
        &self,
        array: &Array,
        values: &[f64],
        active: &[bool],
        children: &[bool],
        out: &mut Vec<u8>,
    ) {
        let is_inactive = |slot: &usize| !active[*slot] && !children[*slot];
        let mut distinct: Vec<f64> = Vec::new();
        for slot in (0..values.len()).filter(is_inactive) {
            if !distinct.contains(&values[slot]) {
                distinct.push(values[slot]);
            }
        }
        let [plus, minus] = [self.background, -self.background];
        let (kind, alone, second) = match distinct[..] {
            _ if self.compression & ACTIVE_MASK == 0 => (6, vec![], None),
            [] => (0, vec![], None),
            [value] if value == plus => (0, vec![], None),
            [value] if value == minus => (1, vec![], None),
            [value] => (2, vec![value], None),
            [a, b] if [a, b] == [minus, plus] || [a, b] == [plus, minus] => (3, vec![], Some(plus)),
            [a, b] if a == plus || b == plus => {
                let other = if a == plus { b } else { a };
                (4, vec![other], Some(plus))
            }
            [a, b] => (5, vec![a, b], Some(b)),
            _ => (6, vec![], None),
        };
        out.push(kind);
        for value in alone {
            out.extend(numbers(array.voxel_type, &[value]));
        }
        if let Some(second) = second {
            let chosen = values.iter().zip(active);
            let chosen: Vec<bool> = chosen
                .map(|(value, is_active)| !is_active && *value == second)
                .collect();
            out.extend(packed_bits(&chosen));
        }
        let is_stored = |slot: &usize| kind == 6 || active[*slot];
        let stored = (0..values.len()).filter(is_stored);
        let stored: Vec<f64> = stored.map(|slot| values[slot]).collect();
        let is_converted =
            self.is_half && matches!(array.voxel_type, VoxelType::F32 | VoxelType::F64);
        let stored_type = if is_converted {
            VoxelType::F16
        } else {
            array.voxel_type
        };
        let plain = numbers(stored_type, &stored);
        let packed = match self.compression & (ZIP | BLOSC) {
            0 => return out.extend(plain),
            // OpenVDB leaves out empty arrays that it converts, and no others.
            _ if is_converted && plain.is_empty() => return,
            ZIP => zlib(&plain),
            _ => Blosc {
                inner: Inner::Lz4,
                shuffle: 1,
                is_split: true,
                block: 1024,
            }
            .packed(&plain, plain.len() / stored.len().max(1)),
        };
        let is_smaller = packed.len() < plain.len();
        let size = packed.len() as i64;
        let size = if is_smaller {
            size
        } else {
            -(plain.len() as i64)
        };
        out.extend(size.to_le_bytes());
        out.extend(if is_smaller { packed } else { plain });
    }
}

/// The value of a lower node that has no child and one value, and whether it is active.
fn of_one_value(slots: &Slots) -> Option<(f64, bool)> {
    let (_, value, is_active) = *slots.values().next()?;
    let is_same = |(leaf, other, is_other_active): &(Option<Leaf>, f64, bool)| {
        leaf.is_none() && *other == value && *is_other_active == is_active
    };
    (slots.len() == 4096 && slots.values().all(is_same)).then_some((value, is_active))
}

fn numbers(voxel_type: VoxelType, values: &[f64]) -> Vec<u8> {
    Array {
        dims: [values.len() as u32, 1, 1],
        voxel_type,
        endian: Endian::Little,
        values: values.to_vec(),
    }
    .bytes()
}

/// The slot of a place in a node with so many slots along each axis, each so many voxels long.
fn slot(side: i64, node: Place, length: i64, place: &Place) -> usize {
    let along = |a: usize| (place[a] - node[a]) / length;
    ((along(0) * side + along(1)) * side + along(2)) as usize
}

fn bits<'a>(
    side: i64,
    node: Place,
    length: i64,
    places: impl Iterator<Item = &'a Place>,
) -> Vec<bool> {
    let mut bits = vec![false; (side * side * side) as usize];
    for place in places {
        bits[slot(side, node, length, place)] = true;
    }
    bits
}

fn packed_bits(bits: &[bool]) -> Vec<u8> {
    let byte = |bits: &[bool]| {
        let bits = bits.iter().rev();
        bits.fold(0, |byte, bit| byte << 1 | u8::from(*bit))
    };
    bits.chunks(8).map(byte).collect()
}
