//! Names of the channels of an EXR, for those who write it and those who read it back.

pub const RGB: [&str; 3] = ["R", "G", "B"];
pub const ALPHA: &str = "A";
pub const STDERR: [&str; 3] = ["stderr.R", "stderr.G", "stderr.B"];
pub const ALBEDO: [&str; 3] = ["albedo.R", "albedo.G", "albedo.B"];
pub const NORMAL: [&str; 3] = ["normal.X", "normal.Y", "normal.Z"];
pub const DEPTH: &str = "depth.Z";

/// The mean of what a shard has sampled, where that is not the picture: noise may put it below 0, and before the first sample
/// the picture is a march.
pub const MEAN: [&str; 3] = ["mean.R", "mean.G", "mean.B"];
/// The fourth channel of that mean.
pub const COVERAGE: &str = "coverage";
pub const SQUARES: [&str; 4] = ["squares.R", "squares.G", "squares.B", "squares.A"];
/// [`Halves`](crate::render::Halves): the mean, and the ratio of variances, under the name that older files have.
pub const HALVES: [&str; 4] = ["halves.R", "halves.G", "halves.B", "halves.A"];
pub const VARIANCE_RATIO: &str = "halves.left";
