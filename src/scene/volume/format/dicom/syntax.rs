//! The transfer syntaxes: how a file encodes its elements, and how it packs its pixels.

use crate::scene::volume::voxel_type::Endian;

/// The encoding of elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Syntax {
    /// Whether each element names its type.
    pub is_explicit: bool,
    pub endian: Endian,
}

impl Syntax {
    pub const EXPLICIT: Syntax = Syntax {
        is_explicit: true,
        endian: Endian::Little,
    };
    pub const IMPLICIT: Syntax = Syntax {
        is_explicit: false,
        endian: Endian::Little,
    };
    pub const BIG: Syntax = Syntax {
        is_explicit: true,
        endian: Endian::Big,
    };
}

/// How the pixels are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Packing {
    Plain,
    RunLength,
    Jpeg,
    Jpeg2000,
    JpegLs,
}

/// The meaning of a transfer syntax's UID.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TransferSyntax {
    pub name: &'static str,
    pub syntax: Syntax,
    /// Whether everything after the meta information is deflated.
    pub is_deflated: bool,
    pub packing: Result<Packing, &'static str>,
}

/// Explicit little-endian elements, and pixels that are not packed.
pub const PLAIN: TransferSyntax = TransferSyntax {
    name: "none",
    syntax: Syntax::EXPLICIT,
    is_deflated: false,
    packing: Ok(Packing::Plain),
};

const fn packed(name: &'static str, packing: Packing) -> TransferSyntax {
    TransferSyntax {
        name,
        packing: Ok(packing),
        ..PLAIN
    }
}

const fn refused(name: &'static str, remedy: &'static str) -> TransferSyntax {
    TransferSyntax {
        name,
        packing: Err(remedy),
        ..PLAIN
    }
}

/// The remedy for pixels that are packed in a way that is not read.
pub const GDCMCONV: &str = "unpack it first: `gdcmconv --raw IN OUT`";

/// The known syntaxes, by the end of the UID after "1.2.840.10008.1.2".
const KNOWN: [(&str, TransferSyntax); 21] = [
    (
        "",
        TransferSyntax {
            syntax: Syntax::IMPLICIT,
            ..PLAIN
        },
    ),
    (".1", PLAIN),
    (
        ".1.99",
        TransferSyntax {
            name: "deflate",
            is_deflated: true,
            ..PLAIN
        },
    ),
    (
        ".2",
        TransferSyntax {
            syntax: Syntax::BIG,
            ..PLAIN
        },
    ),
    (".4.50", packed("JPEG baseline", Packing::Jpeg)),
    (".4.51", packed("JPEG extended", Packing::Jpeg)),
    (".4.57", packed("JPEG lossless", Packing::Jpeg)),
    (".4.70", packed("JPEG lossless", Packing::Jpeg)),
    (".4.80", packed("JPEG-LS", Packing::JpegLs)),
    (".4.81", packed("JPEG-LS", Packing::JpegLs)),
    (".4.90", packed("JPEG 2000 lossless", Packing::Jpeg2000)),
    (".4.91", packed("JPEG 2000", Packing::Jpeg2000)),
    (".4.92", refused("multi-component JPEG 2000", GDCMCONV)),
    (".4.93", refused("multi-component JPEG 2000", GDCMCONV)),
    (".4.100", refused("MPEG-2 video", "it is no volume")),
    (".4.102", refused("MPEG-4 video", "it is no volume")),
    (".4.110", refused("JPEG XL", "unpack it first")),
    (".4.112", refused("JPEG XL", "unpack it first")),
    (".4.201", refused("high-throughput JPEG 2000", GDCMCONV)),
    (".4.203", refused("high-throughput JPEG 2000", GDCMCONV)),
    (".5", packed("RLE", Packing::RunLength)),
];

/// The syntaxes of files that do not name theirs.
pub const IMPLICIT_LITTLE: &str = "1.2.840.10008.1.2";
pub const EXPLICIT_LITTLE: &str = "1.2.840.10008.1.2.1";

/// The syntax of a UID; `None` if that is not known.
pub fn transfer_syntax(uid: &str) -> Option<TransferSyntax> {
    // GE's own, 1.2.840.113619.5.2, is not read: implicit little-endian elements before big-endian pixels.
    let kind = uid.strip_prefix(IMPLICIT_LITTLE)?;
    let found = KNOWN.iter().find(|(known, _)| *known == kind);
    found.map(|(_, syntax)| *syntax)
}
