//! What `unit_sum` holds: units of samples, or the mean of marched rays. It has room for one of them at a time.

use super::bundle::BundleUnderWay;

#[derive(Default)]
pub enum UnderWay {
    #[default]
    Nothing,
    Units(BundleUnderWay),
    /// The mean of so many rays of each pixel, marched through the cache; another ray can be added.
    Rays(u32),
}
