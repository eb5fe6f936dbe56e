//! Pictures in parts: shards of a picture's samples, which merge to what one run would have rendered, and checkpoints,
//! from which a render goes on.
//!
//! Both are EXR files that show a picture and hold the sums behind it, in the precision that they have. A header says
//! what they are of ([`Identity`]) and which samples they hold: parts of different pictures are never put together.

mod file;
mod fingerprint;
mod header;
mod identity;
mod merge;

pub use file::{Shard, read_header};
pub use fingerprint::Fingerprint;
pub use header::{Fill, Header};
pub use identity::{Identity, Named, volume_fingerprint};
pub use merge::{Merged, merge};
