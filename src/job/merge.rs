//! `isolume merge`: one picture of shards.

use crate::cli::MergeArgs;
use crate::error::Result;
use crate::output::{Continuation, Outputs, Provenance, check_inputs_stay, check_writable, say};
use crate::shard;

use super::summary::error_in_words;

pub fn merge(args: &MergeArgs) -> Result<u8> {
    check_writable([&args.output])?;
    check_inputs_stay([&args.output], &args.shards)?;
    let merged = shard::merge(&args.shards)?;
    shard::check_kept(&args.output, &merged.header)?;
    if !args.quiet {
        for note in &merged.notes {
            say(format!("note: {note}"));
        }
    }
    let header = &merged.header;
    let provenance = Provenance::new(
        merged.scene,
        header.identity.seed,
        header.devices.join("; "),
    );
    let continuation = Continuation::of(header, &merged.sums)?;
    let mut outputs = Outputs::default();
    outputs.exr_with(&args.output, &merged.picture, &provenance, continuation)?;
    outputs.commit()?;
    // Without any spread, it is not known here whether the samples have missed light.
    let error = match merged.picture.relative_error() {
        0.0 => f64::INFINITY,
        error => error,
    };
    if !args.quiet {
        let ranges: Vec<String> = header.samples.iter().map(ToString::to_string).collect();
        say(format!(
            "{}: {} samples per pixel ({}) of {} files, relative error {}",
            args.output.display(),
            header.count(),
            ranges.join(", "),
            args.shards.len(),
            error_in_words(error),
        ));
    }
    Ok(0)
}
