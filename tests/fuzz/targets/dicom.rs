//! DICOM: an input is a file, or a folder of files, which may have a directory.

#![no_main]

use isolume::scene::volume::{Pick, Volume};
use isolume_fuzz::dicom_files::{Object, Pixels, Syntax, file};
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
        scan.enhanced(Syntax::Implicit),
        scan.enhanced(Syntax::BigEndian),
        scan.enhanced(Syntax::RunLength),
        scan.enhanced(Syntax::JpegLossless),
        scan.gated(),
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
    let listed = archive::of(|folder| {
        std::fs::write(folder.join("A"), scan.slice_file(0, Syntax::Explicit)).expect("a file");
        std::fs::write(folder.join("B"), scan.slice_file(1, Syntax::Implicit)).expect("a file");
        let record = |name| Object::default().text((4, 0x1500), "CS", name);
        let records = vec![Object::default(), record("A"), record("B")];
        let directory = Object::default().items((4, 0x1220), records);
        let bytes = file(&directory, Syntax::Explicit, Pixels::Words(&[]), 1);
        std::fs::write(folder.join("DICOMDIR"), bytes).expect("a file");
    });
    let single = single.map(|file| [&[0], &file[..]].concat());
    let folders = [[&[8], &series[..]].concat(), [&[8], &listed[..]].concat()];
    single.into_iter().chain(folders).collect()
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
            let directory = path.join("DICOMDIR");
            if directory.is_file() { directory } else { path }
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
