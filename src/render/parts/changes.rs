//! Which parts of a scene an edit has changed, and what becomes stale as a result.
//!
//! `Derived::depends_on` is the only table of dependencies. A test changes every key of the scene file and compares
//! the picture with that of a new renderer, so a dependency that is missing there does not go unseen.

use super::Parts;

/// A part of a scene that can change by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The volume's shape and how it is stored.
    Field,
    Medium,
    /// Any property of a light.
    Lights,
    /// The share that a light has in all light, or where it comes from. A brightness that all lights take on alike
    /// does not change shares.
    LightShares,
    Surfaces,
    /// What surfaces do with light, apart from where they are.
    Materials,
    /// Surfaces that stop light on its way: those of `full` light.
    Obstacles,
    Clips,
    View,
    /// The view, apart from the number of pixels.
    Camera,
    Background,
    MaxBounces,
    Request,
    Display,
    Seed,
}

/// A result that is computed from a scene once, and again when a part that it depends on changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Derived {
    /// The variant and its cache's resolution.
    Plan,
    /// The largest extinction in each block.
    Majorants,
    /// The nearest and farthest distances at which the camera's rays can meet anything.
    Patches,
    /// Where the cache needs memory.
    CacheLayout,
    /// The light in the cache.
    CachedLight,
    /// The table of how surfaces reflect cached light.
    Reflectance,
    /// Paths on their way from the cache's nodes; they carry radiance and not shares of it.
    NodePaths,
    /// The samples of the picture.
    Picture,
    /// What a display shows of the picture.
    Display,
}

impl Derived {
    const fn depends_on(self) -> &'static [Part] {
        use Part::*;
        match self {
            Derived::Plan => &[Field, Request, MaxBounces],
            Derived::Majorants => &[Field, Medium],
            Derived::Patches => &[Field, Medium, Surfaces, Camera],
            Derived::CacheLayout => &[Field, Medium, Obstacles, Clips],
            Derived::CachedLight => &[Field, Medium, LightShares, Obstacles, Clips],
            Derived::Reflectance => &[Materials],
            Derived::NodePaths => &[Field, Medium, Lights, Obstacles, Clips],
            Derived::Picture => &[
                Field, Medium, Lights, Surfaces, Clips, View, Background, MaxBounces, Request, Seed,
            ],
            Derived::Display => &[Display],
        }
    }
}

/// The parts in which two states of a scene differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Changes(u16);

impl Changes {
    /// Everything is new.
    pub const ALL: Changes = Changes(u16::MAX);

    pub fn between(before: &Parts, after: &Parts) -> Changes {
        // Without `..`, so that a new part cannot be left out.
        let Parts {
            field,
            medium,
            lights,
            surfaces,
            clips,
            view,
            background,
            max_bounces,
            request,
            display,
            seed,
        } = before;
        let differs = [
            (Part::Field, *field != after.field),
            (Part::Medium, *medium != after.medium),
            (Part::Lights, *lights != after.lights),
            (Part::LightShares, !lights.have_shares_of(&after.lights)),
            (Part::Surfaces, *surfaces != after.surfaces),
            (
                Part::Materials,
                !surfaces.have_materials_of(&after.surfaces),
            ),
            (
                Part::Obstacles,
                surfaces.obstacles() != after.surfaces.obstacles(),
            ),
            (Part::Clips, *clips != after.clips),
            (Part::View, *view != after.view),
            (Part::Camera, view.with_size(after.view.size) != after.view),
            (Part::Background, *background != after.background),
            (Part::MaxBounces, *max_bounces != after.max_bounces),
            (Part::Request, *request != after.request),
            (Part::Display, *display != after.display),
            (Part::Seed, *seed != after.seed),
        ];
        let changed = differs.into_iter().filter(|(_, differs)| *differs);
        Changes(changed.fold(0, |bits, (part, _)| bits | 1 << part as u16))
    }

    pub fn has(self, part: Part) -> bool {
        self.0 & 1 << part as u16 != 0
    }

    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether `derived` has to be worked out again.
    pub fn invalidates(self, derived: Derived) -> bool {
        derived.depends_on().iter().any(|&part| self.has(part))
    }
}
