//! DICOM: an input is a file, or a folder of files.

#![no_main]

use isolume::scene::volume::{Pick, Volume};
use isolume_fuzz::dicom_files::{Pixels, Syntax, file};
use isolume_fuzz::dicom_scan::{COLUMNS, Scan};
use isolume_fuzz::{archive, folder, guard, target, volume};

fn seeds() -> Vec<Vec<u8>> {
    let scan = Scan::ct();
    let packed = |syntax, frame: &[u8]| {
        file(
            &scan.header(0),
            syntax,
            Pixels::Packed(&[frame.to_vec()]),
            COLUMNS,
        )
    };
    let single = [
        scan.slice_file(0, Syntax::Explicit),
        scan.slice_file(0, Syntax::Implicit),
        scan.slice_file(0, Syntax::Deflated),
        scan.slice_file(0, Syntax::RunLength),
        scan.slice_file(0, Syntax::JpegLossless),
        scan.enhanced(Syntax::Explicit),
        scan.enhanced(Syntax::BigEndian),
        packed(
            Syntax::JpegLs,
            include_bytes!("../../support/dicom/slice0.jls"),
        ),
        packed(
            Syntax::Jpeg2000,
            include_bytes!("../../support/dicom/slice0.j2k"),
        ),
    ];
    let series = archive::of(|folder| {
        let mut few = scan.clone();
        few.slices.truncate(3);
        few.write(folder, Syntax::Explicit, |n| format!("{n}.dcm"));
    });
    let single = single.map(|file| [&[0], &file[..]].concat());
    single
        .into_iter()
        .chain([[&[8], &series[..]].concat()])
        .collect()
}

fn parse(bytes: &[u8]) {
    let Some((more, mut overrides, rest)) = volume::options(bytes) else {
        return;
    };
    let path = match more & 1 {
        0 => folder::write("v.dcm", rest),
        _ => {
            let path = folder::empty("series");
            archive::unpack(rest, &path);
            path
        }
    };
    overrides.series = (more & 2 != 0).then_some(Pick::Number(1));
    overrides.fill_gaps = more & 4 != 0;
    let allowed = volume::allowed_in_chunks(rest.len());
    volume::check(&path, &overrides, allowed);
    if more & 8 != 0 {
        let series = guard::run(allowed, || Volume::series(&path).unwrap_or_default());
        let previews = guard::run(allowed, || Volume::previews(&path).unwrap_or_default());
        assert!(previews.is_empty() || previews.len() <= series.len());
    }
}

target!(seeds, parse);
