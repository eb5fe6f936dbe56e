//! The checksum of Zarr's shards and chunks: CRC-32 with Castagnoli's polynomial (RFC 3720, B.4).

const TABLE: [u32; 256] = table();

const fn table() -> [u32; 256] {
    const POLYNOMIAL: u32 = 0x82f6_3b78;
    let mut table = [0; 256];
    let mut n = 0;
    while n < 256 {
        let mut remainder = n as u32;
        let mut bit = 0;
        while bit < 8 {
            let is_odd = remainder & 1 == 1;
            remainder = (remainder >> 1) ^ if is_odd { POLYNOMIAL } else { 0 };
            bit += 1;
        }
        table[n] = remainder;
        n += 1;
    }
    table
}

fn checksum(bytes: &[u8]) -> u32 {
    let step = |sum: u32, byte: &u8| TABLE[(sum as u8 ^ byte) as usize] ^ sum >> 8;
    !bytes.iter().fold(!0, step)
}

/// The bytes without the checksum at their end, if that is right.
pub fn checked(mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    let (rest, sum) = bytes.split_last_chunk()?;
    let (length, is_right) = (rest.len(), checksum(rest) == u32::from_le_bytes(*sum));
    bytes.truncate(length);
    is_right.then_some(bytes)
}

#[cfg(test)]
mod tests {
    /// RFC 3720, B.4.
    #[test]
    fn known_checksums() {
        assert_eq!(super::checksum(&[0; 32]), 0x8a91_36aa);
        assert_eq!(super::checksum(&[0xff; 32]), 0x62a8_ab43);
        assert_eq!(super::checksum(b"123456789"), 0xe306_9283);
    }
}
