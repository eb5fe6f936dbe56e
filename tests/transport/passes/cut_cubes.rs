//! `cut_cubes` marks the cubes between the cache's nodes that a surface cuts. A cut that it misses lets light through
//! a wall; a mark too many costs a path. So every cube over which the field takes values on both sides of a surface
//! has to be marked, and none that has no voxels on both sides within one voxel of it, or at scale 1 within itself. It also
//! says on which side of the surfaces each node is.

use fastrand::Rng;
use glam::{DVec3, UVec3};
use isolume::gpu::*;
use isolume::render::shared::{BRICK, CUT_WORDS, NO_PLACE};
use isolume::render::{Cache, CacheLayout};
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::voxels;
use crate::support::oracle::field::value_at;
use crate::support::probe::NOTHING;

/// Waves and noise, so that surfaces bend within cells and pass between them.
fn volume(dims: [u32; 3], is_8_bit: bool) -> Volume {
    let mut random = Rng::with_seed(6);
    let shares = voxels(dims).map(|voxel| {
        let [x, y, z] = voxel.map(f64::from);
        let wave = (0.4 * x).sin() + (0.3 * y + 0.2 * z).cos();
        (0.5 + 0.2 * wave + 0.1 * random.f64()).clamp(0.0, 1.0)
    });
    let voxels = if is_8_bit {
        Voxels::U8(shares.map(|s| (255.0 * s).round() as u8).collect())
    } else {
        Voxels::F32(shares.map(|s| (255.0 * s) as f32).collect())
    };
    Volume::from_values(dims, [1.0; 3], voxels).expect("a volume")
}

/// Medium everywhere, so that every brick has memory.
fn scene(isovalues: &[f64]) -> Scene {
    let camera = Camera {
        eye: [0.0, 0.0, 100.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 8.0 },
    };
    let mut scene = empty_scene([8, 8], camera);
    scene.medium = Some(uniform_medium(0.1, 0.5, 0.0));
    scene.surfaces.light = LightModel::Full;
    scene.surfaces.iso = isovalues
        .iter()
        .map(|&value| Isosurface {
            value,
            opacity: 1.0,
            color: [0.5; 3],
            shading: Shading::Lambert,
        })
        .collect();
    scene
}

/// A bit for each cube of each brick and two for each node, as the shaders that read the cache find them.
struct Marks {
    layout: CacheLayout,
    pages: Vec<u32>,
    words: Vec<u32>,
}

impl Marks {
    fn read(cached: &Cached) -> Marks {
        let cache: &Cache = cached.cache();
        let memory = Memory::new(&cached.device, 1 << 24).expect("memory");
        let mut frame = Frame::new(&cached.device).expect("a frame");
        let cuts = cache.memory.cuts.as_ref().expect("cuts, in full light");
        let desc = BufferDesc {
            name: "marks",
            placement: Placement::HostCached,
            ..*cuts.desc()
        };
        let words = Buffer::new(&memory, desc).expect("a buffer");
        frame
            .run(|recording| recording.copy(cuts, &words))
            .expect("a copy");
        let marks = Marks {
            pages: cache.memory.layout.pages(),
            words: words.read_vec(cuts.desc().bytes as usize / 4),
            layout: cache.memory.layout.clone(),
        };
        assert_silent(&cached.device);
        marks
    }

    /// Cubes that are read: from each node to the next.
    fn cubes(&self) -> impl Iterator<Item = UVec3> {
        indices(self.layout.nodes.map(|n| (n - 1).max(1)))
    }

    fn nodes(&self) -> impl Iterator<Item = UVec3> {
        indices(self.layout.nodes)
    }

    fn is_marked(&self, cube: UVec3) -> bool {
        let [first, index] = self.place(cube);
        self.words[first + index / 32] >> (index % 32) & 1 == 1
    }

    fn side(&self, node: UVec3) -> u32 {
        let [first, index] = self.place(node);
        self.words[first + 2 + index / 16] >> (2 * (index % 16)) & 3
    }

    /// The first word of the brick of a node or a cube, and its index among those of its brick.
    fn place(&self, node: UVec3) -> [usize; 2] {
        let [width, height, _] = self.layout.bricks;
        let brick = node / BRICK;
        let page = self.pages[((brick.z * height + brick.y) * width + brick.x) as usize];
        assert_ne!(page, NO_PLACE, "brick {brick} has no memory");
        let place = UVec3::new(page, page >> 10, page >> 20) & 1023;
        let [width, height, _] = self.layout.places;
        let place = (place.z * height + place.y) * width + place.x;
        let inner = node % BRICK;
        let index = (inner.z * BRICK + inner.y) * BRICK + inner.x;
        [(CUT_WORDS * place) as usize, index as usize]
    }
}

/// Of so many nodes or cubes along each axis.
fn indices(count: [u32; 3]) -> impl Iterator<Item = UVec3> {
    let count = UVec3::from(count);
    (0..count.element_product())
        .map(move |n| UVec3::new(n, n / count.x, n / (count.x * count.y)) % count)
}

/// A cube's ends along each axis, in voxels from the centre of the first: from its node to the next one, or to the
/// box's face.
fn ends(layout: &CacheLayout, volume: &Volume, cube: UVec3) -> [[f64; 2]; 3] {
    std::array::from_fn(|a| {
        let (dims, nodes) = (f64::from(volume.dims[a]), f64::from(layout.nodes[a]));
        let node = |n: u32| (f64::from(n) + 0.5) * dims / nodes - 0.5;
        let is_last = cube[a] + 2 >= layout.nodes[a];
        [
            if cube[a] == 0 { -0.5 } else { node(cube[a]) },
            if is_last {
                dims - 0.5
            } else {
                node(cube[a] + 1)
            },
        ]
    })
}

/// The least and the largest value of the field between the ends: it has them at corners of what cells have of that.
fn range(volume: &Volume, ends: [[f64; 2]; 3]) -> [f64; 2] {
    let half = DVec3::from(volume.extent()) / 2.0;
    let planes = ends.map(|[low, high]| {
        let inner = (low.ceil() as i64..=high.floor() as i64).map(|n| n as f64);
        inner.chain([low, high]).collect::<Vec<f64>>()
    });
    let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY];
    for &z in &planes[2] {
        for &y in &planes[1] {
            for &x in &planes[0] {
                let value = value_at(volume, DVec3::new(x, y, z) + 0.5 - half);
                (least, most) = (least.min(value), most.max(value));
            }
        }
    }
    [least, most]
}

/// The least and the largest voxel within one voxel of the ends.
fn range_nearby(volume: &Volume, ends: [[f64; 2]; 3]) -> [f64; 2] {
    let nearby = std::array::from_fn(|a| {
        let last = f64::from(volume.dims[a] - 1);
        let [low, high] = ends[a];
        [
            (low - 1.0).ceil().clamp(0.0, last),
            (high + 1.0).floor().clamp(0.0, last),
        ]
    });
    range(volume, nearby)
}

/// Returns how many cubes are cut, marked, and neither.
fn judge(cached: &Cached, volume: &Volume, isovalues: &[f64]) -> [usize; 3] {
    let marks = Marks::read(cached);
    let half = DVec3::from(volume.extent()) / 2.0;
    for node in marks.nodes() {
        let step = DVec3::from(marks.layout.step.map(f64::from));
        let value = value_at(volume, (node.as_dvec3() + 0.5) * step - half);
        let is_on_surface = isovalues.iter().any(|&v| (value - v).abs() < 1e-3);
        let inside = isovalues.iter().filter(|&&v| value >= v).count();
        assert!(
            is_on_surface || marks.side(node) == inside as u32,
            "node {node}, where the field is {value}"
        );
    }
    let is_cut = |[low, high]: [f64; 2]| isovalues.iter().any(|&v| low < v && high >= v);
    let is_touched = |[low, high]: [f64; 2]| isovalues.iter().any(|&v| low <= v && high >= v);
    let mut counts = [0; 3];
    for cube in marks.cubes() {
        let ends = ends(&marks.layout, volume, cube);
        let (cut, marked) = (is_cut(range(volume, ends)), marks.is_marked(cube));
        assert!(!cut || marked, "{isovalues:?} cut cube {cube} unseen");
        // At scale 1 a cube has the corners of a cell.
        let near = if marks.layout.scale == 1.0 {
            is_touched(range(volume, ends))
        } else {
            is_cut(range_nearby(volume, ends))
        };
        assert!(!marked || near, "nothing cuts the marked cube {cube}");
        counts[0] += usize::from(cut);
        counts[1] += usize::from(marked);
        counts[2] += usize::from(!marked);
    }
    counts
}

/// The large one has more bricks than the pass has workgroups in a row.
#[test]
fn every_cube_that_a_surface_cuts_is_marked_and_none_far_from_it() {
    let shaders = shaders()
        .with_file("node_tracking.comp", NOTHING)
        .with_file("cached_tracking.comp", NOTHING);
    for (dims, scale, is_8_bit) in [
        ([45, 50, 47], 1.0, true),
        ([19, 22, 17], 1.0, false),
        ([19, 22, 17], 0.5, true),
        ([30, 17, 21], 0.25, false),
        ([41, 32, 27], 0.125, true),
        ([23, 1, 9], 0.5, false),
    ] {
        let volume = volume(dims, is_8_bit);
        let mut isovalues = vec![60.0, 171.5];
        let scene = scene_with_cache(&scene(&isovalues), &volume, scale, CacheFormat::F32, 1);
        let mut cached = empty_cache(device(), &shaders, &volume, scene);
        let before = judge(&cached, &volume, &isovalues);

        isovalues[0] = 120.25;
        let edited = self::scene(&isovalues);
        let next = cached.renderer.scene().changed_to(&edited, &volume);
        cached.renderer.change(&next).expect("an edit");
        let after = judge(&cached, &volume, &isovalues);
        println!("{dims:?} at scale {scale}: cut, marked, unmarked {before:?}, then {after:?}");
        assert!(before[0] > 0 && after[0] > 0);
        // A lattice so coarse that all of its cubes are cut stays so.
        assert!(before[2] == 0 || after != before, "the edit marks the same");
    }
}
