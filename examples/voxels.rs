//! Loads a volume and writes its values as a NRRD, for somebody who wants to compare them with what
//! another program makes of the same files: `voxels VOLUME OUT.nrrd [SERIES]`.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use isolume::scene::volume::{Pick, Volume, VolumeOverrides, Voxels};

fn main() -> ExitCode {
    match write() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn write() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output, rest @ ..] = &arguments[..] else {
        return Err("expected VOLUME OUT.nrrd [SERIES]".into());
    };
    let overrides = VolumeOverrides {
        series: rest
            .first()
            .map(|n| n.parse().map(Pick::Number))
            .transpose()?,
        ..VolumeOverrides::default()
    };
    let volume = Volume::load(Path::new(input), &overrides)?;
    for note in &volume.notes {
        eprintln!("note: {note}");
    }
    let value = |stored: f64| volume.offset + volume.scale * stored;
    let voxels = volume.voxels()?;
    let values: Vec<f64> = match &*voxels {
        Voxels::U8(voxels) => voxels.iter().map(|v| value((*v).into())).collect(),
        Voxels::U16(voxels) => voxels.iter().map(|v| value((*v).into())).collect(),
        Voxels::F32(voxels) => voxels.iter().map(|v| value((*v).into())).collect(),
    };
    let ([x, y, z], [a, b, c]) = (volume.dims, volume.spacing);
    let axes = volume
        .axes
        .map_or("unknown".into(), |axes| axes.to_string());
    let mut file = std::fs::File::create(output)?;
    write!(
        file,
        "NRRD0004\n# axes {axes}\ntype: double\ndimension: 3\nsizes: {x} {y} {z}\nspacings: {a} {b} {c}\n\
         endian: little\nencoding: raw\n\n"
    )?;
    let bytes: Vec<u8> = values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    file.write_all(&bytes)?;
    Ok(())
}
