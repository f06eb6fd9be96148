//! Base64 digits.
//!
//! Source: Josefsson, RFC 4648, section 4.

/// The digits of whole groups: `bytes` three by three, `digits` four by four.
pub(crate) fn encode(bytes: &[u8], digits: &mut [u8]) {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (three, four) in bytes.chunks_exact(3).zip(digits.chunks_exact_mut(4)) {
        let bits = u32::from_be_bytes([0, three[0], three[1], three[2]]);
        for (digit, shift) in four.iter_mut().zip([18, 12, 6, 0]) {
            *digit = DIGITS[(bits >> shift & 63) as usize];
        }
    }
}

/// The digits of any bytes, padded to whole groups.
pub(crate) fn text(bytes: &[u8]) -> Vec<u8> {
    let whole = bytes.len() / 3 * 3;
    let mut digits = vec![0; bytes.len().div_ceil(3) * 4];
    let (head, last) = digits.split_at_mut(whole / 3 * 4);
    encode(&bytes[..whole], head);
    if !last.is_empty() {
        let rest = &bytes[whole..];
        let mut group = [0; 3];
        group[..rest.len()].copy_from_slice(rest);
        encode(&group, last);
        last[1 + rest.len()..].fill(b'=');
    }
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_those_of_rfc_4648() {
        for (bytes, digits) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(text(bytes.as_bytes()), digits.as_bytes());
        }
        assert_eq!(text(&[255, 254, 62 << 2]), b"//74");
    }
}
