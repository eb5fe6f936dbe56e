//! Which of the cache's bricks the current view reads, and how much each weighs in the picture. Paths are divided among the
//! bricks by that.

use super::error::Measured;
use super::focus::{self, Focus};
use crate::render::gpu_scene::GpuScene;
use crate::render::layout::CacheLayout;

/// How paths are divided among the bricks, and why.
pub struct Sight {
    pub focus: Focus,
    /// The largest distance, in pixels along both axes, between the rays by which bricks are weighed. `None`: bricks
    /// are not weighed, and all get the same number of paths.
    stride: Option<u32>,
    /// All nodes get the same number of paths, since pictures will be taken from everywhere.
    pub serves_all_views: bool,
    /// The camera is about to move: no node is left without a path for long.
    pub expects_motion: bool,
    /// The camera moves: what is known of the view need not be exact, and waits for no brick of the volume.
    pub in_motion: bool,
    pub view: ViewState,
}

/// What is known of the current view.
#[derive(Debug, Default)]
pub struct ViewState {
    /// Whether the bricks have been weighed.
    pub(super) is_weighed: bool,
    /// The pictures by which the error was last measured, if it was.
    pub(super) measured: Option<Measured>,
    /// Whether bricks of the volume may have been missing in that.
    pub(super) is_preview: bool,
}

impl Sight {
    pub fn new(scene: &GpuScene, layout: &CacheLayout) -> Sight {
        Sight {
            focus: Focus::everywhere(layout),
            stride: stride(scene),
            serves_all_views: false,
            expects_motion: false,
            in_motion: false,
            view: ViewState::default(),
        }
    }

    /// The camera rests: what was found while bricks may have been missing is to be found anew.
    pub fn rest(&mut self) {
        if self.view.is_preview {
            self.view = ViewState::default();
        }
    }

    /// The largest distance between the rays by which bricks are to be weighed; `None` if all get the same number of paths.
    pub fn weighing_stride(&self) -> Option<u32> {
        self.stride.filter(|_| !self.serves_all_views)
    }

    /// Adapts to another view.
    pub fn change_view(&mut self, scene: &GpuScene) {
        self.stride = stride(scene);
        self.view = ViewState::default();
    }

    /// Forgets which paths the bricks have had, and the view.
    pub fn clear(&mut self, layout: &CacheLayout) {
        self.focus = Focus::everywhere(layout);
        self.view = ViewState::default();
    }

    /// All nodes get the same number of paths from now on.
    pub fn serve_all_views(&mut self) {
        self.serves_all_views = true;
        self.view.is_weighed = false;
    }
}

/// `None` unless the picture at rest is marched: only then is the cache read where it is seen, and nowhere else.
fn stride(scene: &GpuScene) -> Option<u32> {
    focus::longest_stride(scene).filter(|_| scene.features().is_marched())
}
