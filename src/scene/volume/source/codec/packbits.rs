//! PackBits: runs of one byte, and literal bytes.

/// Decodes up to `expected` bytes; fewer if the data end before.
pub fn decode(packed: &[u8], expected: usize) -> Vec<u8> {
    let mut decoded = super::reserved(packed, expected);
    let mut rest = packed;
    while let [count, tail @ ..] = rest
        && decoded.len() < expected
    {
        let room = expected - decoded.len();
        rest = match (*count as i8, tail) {
            (-128, _) => tail,
            (count @ 0.., _) => {
                let (bytes, later) = tail.split_at(tail.len().min(count as usize + 1));
                decoded.extend_from_slice(&bytes[..bytes.len().min(room)]);
                later
            }
            (count, [byte, later @ ..]) => {
                let length = 1 - isize::from(count);
                decoded.resize(decoded.len() + room.min(length as usize), *byte);
                later
            }
            (_, []) => tail,
        };
    }
    decoded
}
