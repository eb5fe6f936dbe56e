//! The header of a shard's EXR, as JSON in the attribute `isolume.shard`.

use serde::{Deserialize, Serialize};

use super::Fingerprint;
use super::identity::Identity;
use crate::engine::{Engine, SampleRange};
use crate::render::Sums;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    pub identity: Identity,
    /// The samples that every pixel has had, in ascending order.
    pub samples: Vec<SampleRange>,
    /// Units of the picture; their spread gives its standard error.
    pub units: u32,
    /// Camera paths of those samples.
    pub paths: u64,
    /// Reads of the volume by those samples.
    pub lookups: u64,
    /// Number of samples at the last measurement of how evenly they are spread.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub halves: Option<u32>,
    /// The cache's fillings that the samples have read.
    pub fills: Vec<Fill>,
    /// The devices and drivers that have rendered it.
    pub devices: Vec<String>,
    /// Checksum of the sums.
    pub checksum: String,
}

/// A filling of the cache. All samples that read it share its error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fill {
    /// Fingerprint of its light.
    pub id: String,
    /// Relative error of what a picture at rest takes from it; `None` while that is unknown.
    pub relative_error: Option<f64>,
    /// Samples that have read it.
    pub samples: u32,
}

impl Header {
    /// The header of the picture that the engine has so far. `fill` identifies the light of its cache, if it has one.
    pub fn of(engine: &Engine, identity: Identity, sums: &Sums, fill: Option<&str>) -> Header {
        let totals = engine.totals();
        let range = SampleRange {
            first: totals.first_sample,
            end: totals.first_sample + totals.samples,
        };
        let device = engine.host().summary();
        let cache_error = engine.cache_error_at_rest();
        Header {
            identity,
            samples: Some(range).filter(|r| r.count() > 0).into_iter().collect(),
            units: totals.units,
            paths: totals.paths - totals.paths_before,
            lookups: totals.lookups - totals.lookups_before,
            halves: sums.halves.as_ref().map(|halves| halves.samples),
            fills: fill
                .map(|id| Fill {
                    id: id.into(),
                    relative_error: cache_error.filter(|error| error.is_finite()),
                    samples: totals.samples,
                })
                .into_iter()
                .collect(),
            devices: vec![format!("{}, {}", device.name, device.driver)],
            checksum: checksum(sums),
        }
    }

    /// Samples of every pixel.
    pub fn count(&self) -> u32 {
        let counts = self.samples.iter().map(SampleRange::count);
        counts.fold(0, u32::saturating_add)
    }

    /// Relative error of the fillings' pictures, as far as all samples share it. Fillings of one seed share random
    /// numbers, so their errors add up.
    pub fn cache_error(&self) -> f64 {
        let count = f64::from(self.count().max(1));
        let errors = self.fills.iter().map(|fill| {
            fill.relative_error.unwrap_or(f64::INFINITY) * f64::from(fill.samples) / count
        });
        errors.sum()
    }

    /// Whether a file may have this header. The error says what is wrong with it.
    pub(super) fn check(&self) -> Result<(), String> {
        let ranges = &self.samples;
        let is_in_order = ranges.windows(2).all(|pair| pair[0].end <= pair[1].first);
        let is_sound = |range: &SampleRange| range.first < range.end;
        let most = ranges.last().map_or(0, |last| last.end);
        if !is_in_order || !ranges.iter().all(is_sound) || most > SampleRange::MOST {
            return Err(format!(
                "its header is damaged: ranges of samples are empty, overlap, are out of order or end beyond {}",
                SampleRange::MOST
            ));
        }
        if self.halves.is_some_and(|samples| samples > self.count()) {
            return Err(
                "its header is damaged: it counts more samples in its halves than in all".into(),
            );
        }
        if self.units > self.count() {
            return Err("its header is damaged: it counts more units than samples".into());
        }
        Ok(())
    }
}

pub(super) fn checksum(sums: &Sums) -> String {
    let of_sums = Fingerprint::default()
        .with(bytemuck::cast_slice(&sums.mean))
        .with(bytemuck::cast_slice(&sums.squares));
    let of_all = match &sums.halves {
        Some(halves) => of_sums
            .with(bytemuck::cast_slice(&halves.mean))
            .with(bytemuck::cast_slice(&halves.variance_ratio)),
        None => of_sums,
    };
    of_all.text()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(fills: &[(&str, f64, u32)]) -> Header {
        let fill = |&(id, error, samples): &(&str, f64, u32)| Fill {
            id: id.into(),
            relative_error: Some(error),
            samples,
        };
        let end = fills.iter().map(|fill| fill.2).sum();
        Header {
            identity: Identity {
                scene: String::new(),
                volume: String::new(),
                size: [1, 1],
                seed: 0,
                variant: String::new(),
                transport: String::new(),
            },
            samples: vec![SampleRange { first: 0, end }],
            units: end,
            paths: 0,
            lookups: 0,
            halves: None,
            fills: fills.iter().map(fill).collect(),
            devices: Vec::new(),
            checksum: String::new(),
        }
    }

    /// As if they were independent, more fillings would lower it.
    #[test]
    fn the_errors_of_fillings_add_up() {
        assert_eq!(header(&[]).cache_error(), 0.0);
        assert_eq!(header(&[("a", 0.02, 64)]).cache_error(), 0.02);
        let two = header(&[("a", 0.02, 96), ("b", 0.06, 32)]);
        assert!((two.cache_error() - 0.03).abs() < 1e-12);
    }
}
