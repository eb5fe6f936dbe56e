//! Where the cache's nodes are, and which of them have memory.
//!
//! Nodes lie at the centres of equal cells that fill the box, `scale` of them to a voxel along each
//! axis. They come in bricks of `BRICK`³; a brick gets a place in the cache's images only if a macrocell
//! within reach of its nodes scatters light or shows a surface. The page table says which place: ten
//! bits for each axis.

use std::sync::Arc;

use rayon::prelude::*;

use super::occupancy::Occupancy;
use crate::error::{MemoryError, Result};
use crate::render::packed::{self, pack, position, unpack};
use crate::render::parts::Parts;
use crate::render::shared::{BEND_DEPTH, BRICK, JUMP_DEPTH, NO_PLACE, RIM_DEPTH};
use crate::scene::CacheFormat;

/// The share of bricks with memory that may be of no use before the others get smaller images.
const MOST_IDLE: f64 = 0.4;

/// The widest step from node to node, in voxels, where bricks begin with the coarse lattice of nodes.
const WIDEST_STEP: f32 = 2.5;

#[derive(Debug, Clone)]
pub struct CacheLayout {
    /// Nodes per voxel along an axis.
    pub scale: f64,
    pub is_f16: bool,
    /// Nodes along each axis.
    pub nodes: [u32; 3],
    /// Distance from node to node in grid units.
    pub step: [f32; 3],
    /// Bricks along each axis.
    pub bricks: [u32; 3],
    /// Lattice positions of the bricks that have memory, packed: ten bits for each axis. Shared, since layouts are copied and
    /// compared whenever the camera moves.
    pub active: Arc<[u32]>,
    /// Places for bricks along each axis of the images.
    pub places: [u32; 3],
    /// Light is read close to a face of the box.
    pub meets_faces: bool,
    /// Nodes gather from each other at first (`gathering.glsl`).
    pub gathers: bool,
}

/// Equal layouts have the same nodes in the same memory, which then holds the same light. What reads that light may differ.
impl PartialEq for CacheLayout {
    fn eq(&self, other: &CacheLayout) -> bool {
        self.scale == other.scale
            && self.is_f16 == other.is_f16
            && self.nodes == other.nodes
            && self.active == other.active
            && self.places == other.places
    }
}

impl CacheLayout {
    /// `format` must be decided. Fails where images of `most_texels` a side are too small.
    pub fn new(
        dims: [u32; 3],
        occupancy: &Occupancy,
        scale: f64,
        format: CacheFormat,
        most_texels: u32,
    ) -> Result<CacheLayout, MemoryError> {
        let nodes = dims.map(|n| (n as f64 * scale).ceil() as u32);
        let step = std::array::from_fn(|a| dims[a] as f32 / nodes[a] as f32);
        let bricks = nodes.map(|n| n.div_ceil(BRICK));
        if bricks.iter().any(|&n| n > packed::MOST) {
            let limit = packed::MOST * BRICK;
            return Err(MemoryError::CacheNodes { nodes, limit });
        }
        let active = active_bricks(bricks, step, occupancy);
        let most_places = (most_texels / BRICK).min(packed::MOST - 1);
        let Some(places) = places(active.len() as u32, most_places) else {
            return Err(MemoryError::CacheBricks {
                bricks: active.len(),
                texels: most_texels,
            });
        };
        Ok(CacheLayout {
            scale,
            is_f16: format == CacheFormat::F16,
            nodes,
            step,
            bricks,
            active: active.into(),
            places,
            meets_faces: occupancy.meets_faces(),
            gathers: nodes.iter().all(|&n| n > 1),
        })
    }

    /// The same nodes with another format of their light.
    pub fn with_format(self, format: CacheFormat) -> CacheLayout {
        CacheLayout {
            is_f16: format == CacheFormat::F16,
            ..self
        }
    }

    /// This layout, if it has memory wherever another occupancy needs it and little elsewhere, so that its light
    /// stays in sight until there is better; else a new one of the same scale.
    pub fn refitted(
        &self,
        dims: [u32; 3],
        occupancy: &Occupancy,
        most_texels: u32,
    ) -> Result<CacheLayout> {
        let wanted = CacheLayout::new(dims, occupancy, self.scale, self.format(), most_texels)?;
        let idle = 1.0 - wanted.active.len() as f64 / self.active.len() as f64;
        Ok(if self.covers(&wanted) && idle <= MOST_IDLE {
            CacheLayout {
                meets_faces: wanted.meets_faces,
                ..self.clone()
            }
        } else {
            wanted
        })
    }

    /// Whether each brick that has memory in `other`, of the same scale, has memory here as well.
    pub fn covers(&self, other: &CacheLayout) -> bool {
        // Bricks are in order of their packed positions.
        let mut mine = self.active.iter();
        other.active.iter().all(|brick| mine.any(|m| m == brick))
    }

    /// "caching at scale 0.5 in f16", for messages.
    pub fn description(&self) -> String {
        describe_cache(self.scale, self.format())
    }

    pub fn format(&self) -> CacheFormat {
        if self.is_f16 {
            CacheFormat::F16
        } else {
            CacheFormat::F32
        }
    }

    /// Whether bricks begin with the coarse lattice of nodes (`coarse.glsl`).
    pub fn begins_coarse(&self) -> bool {
        self.gathers && self.step.iter().all(|&step| step < WIDEST_STEP)
    }

    /// The place of each brick of the lattice, packed; `NO_PLACE` for bricks without memory.
    pub fn pages(&self) -> Vec<u32> {
        let mut pages = vec![NO_PLACE; self.lattice_bricks()];
        for (place, &brick) in self.active.iter().enumerate() {
            let texel = position(place as u32, self.places);
            pages[self.lattice_index(unpack(brick))] = pack(texel);
        }
        pages
    }

    /// For each brick with memory, in order of places, whether it or a neighbour of it is marked.
    pub fn with_neighbours(&self, marked: &[bool]) -> Vec<bool> {
        let mut lattice = vec![false; self.lattice_bricks()];
        for (&brick, &is_marked) in self.active.iter().zip(marked) {
            lattice[self.lattice_index(unpack(brick))] = is_marked;
        }
        let is_near_marked = |&brick: &u32| {
            let position = unpack(brick);
            let [xs, ys, zs] = std::array::from_fn(|a| {
                position[a].saturating_sub(1)..(position[a] + 2).min(self.bricks[a])
            });
            let rows = zs.flat_map(|z| ys.clone().map(move |y| [y, z]));
            let mut row = rows.flat_map(|[y, z]| xs.clone().map(move |x| [x, y, z]));
            row.any(|near| lattice[self.lattice_index(near)])
        };
        self.active.par_iter().map(is_near_marked).collect()
    }

    fn lattice_bricks(&self) -> usize {
        self.bricks.iter().map(|&n| n as usize).product()
    }

    fn lattice_index(&self, [x, y, z]: [u32; 3]) -> usize {
        let [width, height, _] = self.bricks.map(|n| n as usize);
        (z as usize * height + y as usize) * width + x as usize
    }

    /// The places of all bricks in the order of Morton's curve: bricks that follow one another lie close to each
    /// other.
    pub fn along_curve(&self) -> Vec<u32> {
        let mut places: Vec<u32> = (0..self.active.len() as u32).collect();
        places.sort_by_cached_key(|&place| morton_code(unpack(self.active[place as usize])));
        places
    }

    /// Texels of the images.
    pub fn extent(&self) -> [u32; 3] {
        self.places.map(|n| n * BRICK)
    }

    pub fn all_nodes(&self) -> u64 {
        self.nodes.iter().map(|&n| n as u64).product()
    }

    /// Nodes that have memory.
    pub fn active_nodes(&self) -> u64 {
        let inside = |&brick: &u32| -> u64 {
            let low = unpack(brick).map(|i| i * BRICK);
            (0..3)
                .map(|a| (self.nodes[a] - low[a]).min(BRICK) as u64)
                .product()
        };
        self.active.iter().map(inside).sum()
    }

    /// Whether there may be cubes at the rim of a dense medium (`rim_cubes.comp`): it meets a face of the box or a clip
    /// plane, or is so dense that it may end between two voxels.
    pub fn may_have_rims(&self, parts: &Parts) -> bool {
        let steps = self.step.iter().zip(&parts.field.spacing);
        let sides: Vec<f32> = steps.map(|(step, voxel)| step * voxel).collect();
        let at_faces = if self.meets_faces {
            sides.iter().copied().fold(0.0, f32::max)
        } else {
            0.0
        };
        let at_clips = if parts.clips.is_empty() {
            0.0
        } else {
            sides.iter().map(|side| side * side).sum::<f32>().sqrt()
        };
        let densest = parts.medium.largest_extinction();
        densest * at_clips.max(at_faces) > RIM_DEPTH
            || densest * parts.field.largest_spacing() > JUMP_DEPTH.min(BEND_DEPTH)
    }
}

/// "caching at scale 0.5 in f16", for messages.
pub fn describe_cache(scale: f64, format: CacheFormat) -> String {
    format!("caching at scale {scale} in {}", format.name())
}

/// The bits of ten-bit coordinates, interleaved.
fn morton_code(position: [u32; 3]) -> u32 {
    let [x, y, z] = position.map(|bits| {
        let bits = (bits | bits << 16) & 0x0300_00FF;
        let bits = (bits | bits << 8) & 0x0300_F00F;
        let bits = (bits | bits << 4) & 0x030C_30C3;
        (bits | bits << 2) & 0x0924_9249
    });
    x | y << 1 | z << 2
}

/// Lattice positions of the bricks that need memory. A node is read as far as its neighbours, and near the faces half
/// a cell further.
fn active_bricks(bricks: [u32; 3], step: [f32; 3], occupancy: &Occupancy) -> Vec<u32> {
    let reach = |a: usize| {
        let of_brick = |brick: u32| {
            let low = (brick * BRICK) as f32 - 1.0;
            let high = (brick * BRICK + BRICK + 1) as f32;
            occupancy.span(a, [0.5 + low * step[a], 0.5 + high * step[a]])
        };
        (0..bricks[a]).map(of_brick).collect::<Vec<_>>()
    };
    let spans = [reach(0), reach(1), reach(2)];
    let slice = |z: u32| {
        let mut active = Vec::new();
        for y in 0..bricks[1] {
            let row = occupancy.row(&spans[1][y as usize], &spans[2][z as usize]);
            let is_active = |&x: &u32| row[spans[0][x as usize].clone()].contains(&true);
            active.extend((0..bricks[0]).filter(is_active).map(|x| pack([x, y, z])));
        }
        active
    };
    let slices = (0..bricks[2]).into_par_iter();
    slices.flat_map_iter(slice).collect()
}

/// The smallest box of places for `bricks` bricks with no side longer than `most`, near a cube or a row. As long as a
/// cube leaves room for it, all are narrow enough for the flux of three channels side by side.
fn places(bricks: u32, most: u32) -> Option<[u32; 3]> {
    let bricks = bricks.max(1);
    let cube = (bricks as f64).cbrt().ceil() as u32;
    let widest = if 3 * cube <= most { most / 3 } else { most };
    let widths = (cube..=(2 * cube).min(widest)).chain([widest.min(bricks)]);
    let boxes = widths.flat_map(|width| {
        let square = ((bricks as f64 / width as f64).sqrt().ceil() as u32).clamp(1, most);
        (square..=(2 * square).min(most)).map(move |height| {
            let depth = bricks.div_ceil(width * height);
            [width, height, depth]
        })
    });
    let volume = |b: &[u32; 3]| b.iter().map(|&n| n as u64).product::<u64>();
    boxes.filter(|b| b[2] <= most).min_by_key(volume)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_leave_room_for_three_fluxes() {
        for bricks in [1, 2, 839, 1021, 4099, 100_003, 10_000_019] {
            let [x, y, z] = places(bricks, 1023).expect("a box");
            assert!(
                3 * x <= 1023 && y <= 1023 && z <= 1023,
                "{bricks}: {x}, {y}, {z}"
            );
            assert!(
                (bricks..=bricks + bricks / 8 + 1).contains(&(x * y * z)),
                "{bricks}: {x}, {y}, {z}"
            );
        }
        assert_eq!(places(64 * 64 * 64, 64), Some([64; 3]));
    }
}
