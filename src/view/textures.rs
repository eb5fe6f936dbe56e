//! The user interface's textures besides its font's: egui's colour picker makes some for its gradients. Each has a slot of
//! the canvas's texture, beside the font's part of it.

use std::collections::BTreeMap;

use egui::TextureId;

use crate::gpu::{SLOT_SIDE, SLOTS, slot_corner};

#[derive(Default)]
pub struct Textures(BTreeMap<TextureId, Texture>);

/// A texture in a slot.
#[derive(Clone, Copy)]
pub struct Texture {
    slot: u32,
    /// In texels.
    size: [u32; 2],
}

impl Textures {
    /// The slot of a texture, a free one if it has none. `None` if it is too large, or if all slots are taken.
    pub fn slot_for(&mut self, id: TextureId, size: [u32; 2]) -> Option<Texture> {
        let is_taken = |slot: &u32| self.0.values().any(|texture| texture.slot == *slot);
        let free = || (0..SLOTS).find(|slot| !is_taken(slot));
        let known = self.0.get(&id).map(|texture| texture.slot);
        let slot = known
            .or_else(free)
            .filter(|_| size.iter().all(|&n| n <= SLOT_SIDE))?;
        let texture = Texture { slot, size };
        self.0.insert(id, texture);
        Some(texture)
    }

    pub fn get(&self, id: TextureId) -> Option<Texture> {
        self.0.get(&id).copied()
    }

    pub fn free(&mut self, id: TextureId) {
        self.0.remove(&id);
    }
}

impl Texture {
    /// The texel of the canvas's texture at which it begins.
    pub fn low(&self) -> [u32; 2] {
        slot_corner(self.slot)
    }

    /// A position in it, of which 1 is its end, as a texel of the canvas's texture.
    pub fn texel(&self, uv: [f32; 2]) -> [f32; 2] {
        let low = self.low();
        std::array::from_fn(|a| low[a] as f32 + uv[a] * self.size[a] as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_have_slots_of_their_own() {
        let mut textures = Textures::default();
        let id = TextureId::Managed;
        let size = [SLOT_SIDE, 3];
        let lows: Vec<_> = (1..=u64::from(SLOTS))
            .map(|n| textures.slot_for(id(n), size).expect("a slot").low())
            .collect();
        let side = SLOT_SIDE;
        let overlap = |a: [u32; 2], b: [u32; 2]| (0..2).all(|n| a[n].abs_diff(b[n]) < side);
        for (n, low) in lows.iter().enumerate() {
            assert!(lows[..n].iter().all(|other| !overlap(*low, *other)));
        }
        assert!(textures.slot_for(id(99), size).is_none(), "all are taken");
        assert_eq!(textures.slot_for(id(7), size).unwrap().low(), lows[6]);
        textures.free(id(5));
        assert!(textures.get(id(5)).is_none());
        assert!(textures.slot_for(id(99), [side + 1, 1]).is_none());
        let texture = textures.slot_for(id(99), [10, 20]).unwrap();
        assert_eq!(texture.low(), lows[4]);
        let end = [lows[4][0] as f32 + 10.0, lows[4][1] as f32 + 20.0];
        assert_eq!(texture.texel([1.0, 1.0]), end);
    }
}
