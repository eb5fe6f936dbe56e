//! The picture that is on its way in `unit_sum`, of which there is one at a time.

use super::bundle::BundleUnderWay;

#[derive(Default)]
pub enum UnderWay {
    #[default]
    Nothing,
    Units(BundleUnderWay),
    /// The mean of so many rays of each pixel, marched through the cache; another ray can be added.
    Rays(u32),
}
