//! Random input: what anybody may do in the window with a mouse and a keyboard.

use std::thread::sleep;
use std::time::Duration;

use crate::program::WINDOW;
use crate::window::Window;
use crate::{CONTROL, SHIFT};

/// Panels take that much of the width.
pub const PANELS: usize = 256;
/// Keys of single letters: views, clip plane, what is shown over the picture, back to the first view.
const KEYS: &[u8] = b"123456crpmh";
/// Panels, on and off.
const PANELS_KEY: u8 = b'u';
/// The next variant. Drivers keep some of what they have compiled for each.
const VARIANT_KEY: u8 = b'v';

pub struct Hand {
    pub random: fastrand::Rng,
    /// Pixels of the window that it can reach.
    reach: [i16; 2],
    keys: Vec<u8>,
}

impl Hand {
    /// One that reaches the whole window, and keeps the variant.
    pub fn seeded(seed: u64) -> Hand {
        Hand {
            random: fastrand::Rng::with_seed(seed),
            reach: WINDOW.map(|n| n as i16),
            keys: [KEYS, &[PANELS_KEY]].concat(),
        }
    }

    /// One that reaches the picture, leaves the panels beside it alone, and changes the variant.
    pub fn over_the_picture(seed: u64) -> Hand {
        let [width, height] = WINDOW;
        Hand {
            reach: [width - PANELS, height].map(|n| n as i16),
            keys: [KEYS, &[VARIANT_KEY]].concat(),
            ..Hand::seeded(seed)
        }
    }

    /// Turns, zooms, edits, undoes, resizes or waits.
    pub fn act(&mut self, window: &Window) {
        let display = &window.display;
        match self.random.u32(0..12) {
            0..5 => display.drag(self.random.u8(1..=3), self.place(), self.place()),
            5..7 => self.scroll(window),
            7 => display.holding(SHIFT, || self.scroll(window)),
            8 => {
                let key = *self.random.choice(&self.keys).expect("a key");
                display.strike(&[key.into()]);
            }
            9 => display.strike(&[CONTROL, 'z' as u32]),
            10 => {
                for _ in 0..20 {
                    self.resize(window);
                    sleep(Duration::from_millis(20));
                }
                self.pause(400);
                back_to_first_size(window);
            }
            _ => self.pause(200),
        }
    }

    fn place(&mut self) -> [i16; 2] {
        let random = &mut self.random;
        self.reach.map(|size| random.i16(4..size - 4))
    }

    fn scroll(&mut self, window: &Window) {
        window.display.point(self.place());
        for _ in 0..self.random.u32(1..6) {
            window.display.click(self.random.u8(4..=5));
        }
    }

    pub fn resize(&mut self, window: &Window) {
        window.resize(self.random.u32(1..900), self.random.u32(1..700));
    }

    /// Waits, for less than so long.
    pub fn pause(&mut self, milliseconds: u64) {
        sleep(Duration::from_millis(self.random.u64(0..milliseconds)));
    }
}

pub fn back_to_first_size(window: &Window) {
    window.resize(WINDOW[0] as u32, WINDOW[1] as u32);
}
