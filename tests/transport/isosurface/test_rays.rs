//! Rays of every kind, in grid space: voxel (i, j, k) sits at (i + 1, j + 1, k + 1) and the box is
//! [½, n + ½]. A ray is its f32 numbers, and both sides of a comparison get the same ones.

use glam::DVec3;
use isolume::scene::volume::Volume;
use std::array::from_fn;

use super::TestRay;
use super::judge::Judge;
use crate::support::oracle::random::Random;

pub struct Rays<'a> {
    pub volume: &'a Volume,
    /// For the grazing ones.
    pub ball: Option<Ball>,
    pub random: Random,
}

/// Roughly where a convex surface is, in grid space, and who knows exactly.
pub struct Ball {
    pub center: DVec3,
    pub radius: f64,
    pub judge: Judge,
}

impl Rays<'_> {
    /// `count` rays, as many of each kind.
    pub fn mixed(&mut self, count: usize) -> Vec<TestRay> {
        (0..count)
            .map(|i| match i % 7 {
                0 => self.across(),
                1 => self.starting_within(),
                2 => self.along_an_edge(),
                3 => self.in_a_lattice_plane(),
                4 => self.through_corners(),
                5 => self.one_zero_component(),
                _ if self.ball.is_some() => self.grazing(),
                _ => self.across(),
            })
            .collect()
    }

    fn size(&self, axis: usize) -> f64 {
        f64::from(self.volume.dims[axis])
    }

    fn below(&mut self, n: f64) -> f64 {
        (self.random.uniform() * n).floor()
    }

    fn point(&mut self) -> DVec3 {
        DVec3::from_array(from_fn(|a| 0.5 + self.size(a) * self.random.uniform()))
    }

    /// A voxel's centre.
    fn lattice_point(&mut self) -> DVec3 {
        DVec3::from_array(from_fn(|a| {
            let size = self.size(a);
            1.0 + self.below(size)
        }))
    }

    /// From a face of the box to a point in it.
    fn across(&mut self) -> TestRay {
        let (mut from, to) = (self.point(), self.point());
        let axis = self.below(3.0) as usize;
        let far = self.random.uniform() < 0.5;
        from[axis] = 0.5 + if far { self.size(axis) } else { 0.0 };
        self.ray(from, to - from)
    }

    fn starting_within(&mut self) -> TestRay {
        let (from, direction) = (self.point(), self.random.direction());
        self.ray(from, direction)
    }

    fn along_an_edge(&mut self) -> TestRay {
        let axis = self.below(3.0) as usize;
        let mut from = self.lattice_point();
        from[axis] = self.point()[axis];
        let direction = self.random.uniform() - 0.5;
        self.ray(from, DVec3::AXES[axis] * direction.signum())
    }

    fn in_a_lattice_plane(&mut self) -> TestRay {
        let axis = self.below(3.0) as usize;
        let (mut from, mut direction) = (self.point(), self.random.direction());
        from[axis] = self.lattice_point()[axis];
        direction[axis] = 0.0;
        self.ray(from, direction)
    }

    /// Meets a lattice point every few cells, exactly: three cells' sides at once.
    fn through_corners(&mut self) -> TestRay {
        let from = self.lattice_point();
        let whole = DVec3::from_array(from_fn(|_| self.below(5.0) - 2.0));
        let whole = if whole == DVec3::ZERO {
            DVec3::ONE
        } else {
            whole
        };
        // A power of two keeps the components' ratios exact.
        self.ray_of_step(from, whole * 0.5)
    }

    fn one_zero_component(&mut self) -> TestRay {
        let axis = self.below(3.0) as usize;
        let mut direction = self.random.direction();
        direction[axis] = if self.random.uniform() < 0.5 {
            0.0
        } else {
            -0.0
        };
        let from = self.point();
        self.ray(from, direction)
    }

    /// Past the surface's rim at 10⁻¹ to 10⁻⁷ of a voxel, on either side of it. The voxelised ball's rim
    /// is not quite the ball's, so it is searched for.
    fn grazing(&mut self) -> TestRay {
        let normal = self.random.direction();
        let tangent = self.random.around(normal, 0.0);
        let side = (self.random.uniform() - 0.5).signum();
        let off = side * 10f64.powf(-1.0 - 6.0 * self.random.uniform());
        let ball = self.ball.as_ref().expect("a ball to graze");
        let radius = ball.radius;
        let at = |height: f64| {
            let from = ball.center + height * normal - radius * tangent;
            self.ray(from, tangent)
        };
        let (mut low, mut high) = (radius - 0.5, radius + 0.5);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            if ball.judge.crossings(&at(middle), 0).is_empty() {
                high = middle
            } else {
                low = middle
            }
        }
        at(low + off)
    }

    pub fn ray(&self, from: DVec3, direction: DVec3) -> TestRay {
        let world = (direction * DVec3::from(self.volume.spacing)).length();
        self.ray_of_step(from, direction / world)
    }

    pub fn ray_of_step(&self, from: DVec3, step: DVec3) -> TestRay {
        let mut ray = TestRay {
            origin: from.as_vec3().to_array(),
            step: step.as_vec3().to_array(),
            t_end: 0.0,
            known: -1,
            inside: 0,
        };
        ray.t_end = self.leaves_at(&ray);
        ray
    }

    /// Where the ray leaves the box, in single precision.
    fn leaves_at(&self, ray: &TestRay) -> f32 {
        let leaves = (0..3).map(|a| {
            let (origin, step) = (f64::from(ray.origin[a]), f64::from(ray.step[a]));
            match step {
                0.0 => f64::INFINITY,
                _ if step > 0.0 => (self.size(a) + 0.5 - origin) / step,
                _ => (0.5 - origin) / step,
            }
        });
        leaves.fold(f64::INFINITY, f64::min).max(0.0) as f32
    }

    /// From a point on surface `known`, on the side that `inside` says.
    pub fn leaving(&self, from: [f32; 3], direction: DVec3, known: i32, inside: u32) -> TestRay {
        let mut ray = self.ray(DVec3::ZERO, direction);
        ray.origin = from;
        ray.t_end = self.leaves_at(&ray);
        TestRay {
            known,
            inside,
            ..ray
        }
    }
}
