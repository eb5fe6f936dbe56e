//! The picture's size: that of its place in the window or, where memory is short, a half, a quarter or an eighth of it along
//! each axis.

use super::live::Live;
use super::session::Session;
use super::stage::Stage;
use crate::error::{Error, Result};

/// The last of the numbers by which the picture's pixels along an axis are divided; each is twice the one before.
const LAST_DIVISOR: u32 = 8;

/// The size that was chosen last.
pub struct PictureSize {
    /// Pixels of the window that the picture may take.
    room: [u32; 2],
    /// The picture's pixels are those along an axis, divided by this.
    divisor: u32,
}

impl Default for PictureSize {
    fn default() -> PictureSize {
        PictureSize {
            room: [0; 2],
            divisor: 1,
        }
    }
}

impl PictureSize {
    /// Asks for fewer pixels in the same room, since there is no memory for these. Returns whether there can be fewer.
    pub fn coarsen(&mut self) -> bool {
        let is_possible = self.divisor < LAST_DIVISOR;
        if is_possible {
            self.divisor *= 2;
        }
        is_possible
    }

    /// Adapts the picture to its rectangle in the window, from its low to its high corner. A renderer that leaves no room even
    /// for the smallest picture is dropped, to be planned anew. Returns whether the picture has another size now.
    pub fn follow(
        &mut self,
        [low, high]: [[u32; 2]; 2],
        stage: &mut Stage,
        session: &mut Session,
    ) -> Result<bool> {
        if session.build_under_way().is_some() {
            return Ok(false);
        }
        let room = std::array::from_fn(|a| high[a].saturating_sub(low[a]).max(1));
        let before = stage.picture_size();
        let is_right = |live: &Live| live.engine.scene().render.size == before;
        let is_unchanged = room == self.room
            && before == self.size()
            && !stage.is_outdated()
            && session.live().is_none_or(is_right);
        if is_unchanged {
            session.scene.render.size = before;
            return Ok(false);
        }
        if room != self.room {
            *self = PictureSize { room, divisor: 1 };
        }
        let smallest = room.map(|n| n.div_ceil(LAST_DIVISOR));
        if !has_room(stage, session.live(), smallest)? {
            session.drop_live();
        }
        self.resize_picture(stage, session.live())?;
        let size = stage.picture_size();
        session.scene.render.size = size;
        if let Some(live) = session.live_mut()
            && (size != before || !is_right(live) || stage.is_outdated())
        {
            let fits = match live.resize(size, stage.bytes_now()?) {
                // The change may have stopped half way; if a new renderer fails for the same reason, that is reported.
                Err(Error::Memory(_)) => false,
                fits => fits?,
            };
            if !fits {
                session.drop_live();
            }
        }
        Ok(size != before)
    }

    fn size(&self) -> [u32; 2] {
        self.room.map(|n| n.div_ceil(self.divisor))
    }

    /// Gives the picture that is shown as many pixels as there is memory for, beside the live renderer.
    fn resize_picture(&mut self, stage: &mut Stage, live: Option<&Live>) -> Result<()> {
        loop {
            let is_last = self.divisor == LAST_DIVISOR;
            if is_last || has_room(stage, live, self.size())? {
                match stage.resize_picture(self.size()) {
                    // The driver may have less memory than the budget.
                    Err(Error::Memory(_)) if !is_last => {}
                    resized => return resized,
                }
            }
            self.coarsen();
        }
    }
}

/// Whether there is room for pictures of this size beside the window's images: in the live renderer's plan, or in one that
/// is still to be made.
fn has_room(stage: &Stage, live: Option<&Live>, size: [u32; 2]) -> Result<bool> {
    let for_window = match stage.bytes_ahead(size) {
        Err(Error::Memory(_)) => return Ok(false),
        bytes => bytes?,
    };
    match live {
        Some(live) => live.engine.has_room_for(size, for_window),
        None => Ok(for_window <= stage.memory.budget),
    }
}
