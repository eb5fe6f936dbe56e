//! The size of voxels, as far as a program states it in a TIFF file's description.

use crate::scene::volume::storage::in_one_unit;

pub struct VoxelSize {
    pub spacing: [f64; 3],
    /// The unit of `spacing`, if it is stated.
    pub unit: Option<String>,
    program: &'static str,
    is_stated: [bool; 3],
}

impl VoxelSize {
    /// Nothing is stated: voxels are the unit.
    pub const UNKNOWN: VoxelSize = VoxelSize {
        spacing: [1.0; 3],
        unit: None,
        program: "",
        is_stated: [false; 3],
    };

    /// What `program` states of the lengths along x, y and z, and of their units; an axis without a unit has the first that is
    /// stated. A length that is not stated is `otherwise`, in its axis's unit.
    pub fn new(
        program: &'static str,
        lengths: [Option<f64>; 3],
        units: [Option<&str>; 3],
        otherwise: f64,
    ) -> VoxelSize {
        let unit = units.into_iter().flatten().next();
        let units = units.map(|own| own.or(unit));
        VoxelSize {
            spacing: in_one_unit(lengths.map(|length| length.unwrap_or(otherwise)), units),
            unit: units[0].map(str::to_string),
            program,
            is_stated: lengths.map(|length| length.is_some()),
        }
    }

    /// A sentence about lengths that are not stated, of a volume of this size in full resolution.
    pub fn told(&self, dims: [u32; 3]) -> Option<String> {
        let unit = self.unit.as_ref()?;
        let axes = (0..3).filter(|&a| !self.is_stated[a] && dims[a] > 1);
        let taken: Vec<String> = axes
            .map(|a| format!("{} {unit} along {}", self.spacing[a], ["x", "y", "z"][a]))
            .collect();
        (!taken.is_empty()).then(|| {
            format!(
                "{} does not state the whole voxel size: it is taken as {}; set volume.spacing",
                self.program,
                taken.join(" and ")
            )
        })
    }
}
