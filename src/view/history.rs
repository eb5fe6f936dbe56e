//! Undo and redo: whole scenes, since they are small beside their volume. Cameras are not part of the history.

use crate::scene::Scene;

/// The most steps that can be undone.
const MOST_STEPS: usize = 100;

pub struct History {
    past: Vec<Scene>,
    future: Vec<Scene>,
    /// The scene as it was when the last change had ended.
    committed: Scene,
}

impl History {
    pub fn new(scene: &Scene) -> History {
        History {
            past: Vec::new(),
            future: Vec::new(),
            committed: scene.clone(),
        }
    }

    /// A change is one step, however many frames a drag takes: it ends when no button is down.
    pub fn commit(&mut self, scene: &Scene) {
        let committed = like(&self.committed, scene);
        if committed != *scene {
            self.past.push(self.committed.clone());
            self.future.clear();
            self.committed = scene.clone();
            let excess = self.past.len().saturating_sub(MOST_STEPS);
            self.past.drain(..excess);
        }
    }

    pub fn undo(&mut self, scene: &mut Scene) {
        step(&mut self.past, &mut self.future, &mut self.committed, scene);
    }

    pub fn redo(&mut self, scene: &mut Scene) {
        step(&mut self.future, &mut self.past, &mut self.committed, scene);
    }

    /// Forgets the last change, which could not be shown: `scene` is as it was before.
    pub fn retract(&mut self, scene: &Scene) {
        self.committed = scene.clone();
        for steps in [&mut self.past, &mut self.future] {
            steps.pop_if(|step| like(step, scene) == *scene);
        }
    }

    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }
}

fn step(from: &mut Vec<Scene>, to: &mut Vec<Scene>, committed: &mut Scene, scene: &mut Scene) {
    if let Some(other) = from.pop() {
        to.push(scene.clone());
        *scene = like(&other, scene);
        *committed = scene.clone();
    }
}

/// `scene` with the camera and the picture's size of `other`.
pub fn like(scene: &Scene, other: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.camera = other.camera;
    scene.render.size = other.render.size;
    scene
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::volume::{Volume, Voxels};
    use crate::scene::{SceneFile, resolve};

    fn dense(density: f64) -> Scene {
        let volume = Volume::from_values([1; 3], [1.0; 3], Voxels::U8(vec![1]));
        let text = format!(
            "volume.path = \"v.npy\"\nmedium = {{ density = {density}, transfer = [{{ value = 0 }}] }}"
        );
        let file = SceneFile::parse(&text, "v.toml".as_ref(), &[]).expect("a scene");
        resolve(&file, &volume.expect("a volume"))
            .expect("a scene")
            .0
    }

    #[test]
    fn what_could_not_be_shown_is_no_step() {
        let [first, shown, failed] = [1.0, 2.0, 3.0].map(dense);
        let mut history = History::new(&first);
        history.commit(&shown);
        history.commit(&failed);
        history.retract(&shown);
        history.commit(&shown);
        assert!(!history.can_redo());
        let mut scene = shown;
        history.undo(&mut scene);
        assert!(scene == first && !history.can_undo());
    }
}
