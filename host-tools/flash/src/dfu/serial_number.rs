//! Serial numbers of a board and of its boot loader.
//!
//! Both come from the processor's unique identifier of 96 bits. The board's is all of its bytes, in the order of their addresses, as 24
//! hexadecimal digits. The boot loader's has 12: the sum of the first and the third word, then the upper half of the second. ST does
//! not document it; it is what the boot loaders of STM32F2 and F4 do by their disassembly (libopencm3, issue 760), and what firmware
//! for the STM32G474 relies on (unhuman-io/motorlib, `stm32g4_serial.cpp`). Other families do otherwise. So a number that fits
//! names a boot loader, and one that does not fit proves nothing.

/// Serial number of the boot loader of a board with serial number `board`; none if that is no identifier.
pub fn of_boot_loader(board: &str) -> Option<String> {
    if board.len() != 24 || !board.is_ascii() {
        return None;
    }
    let mut words = [0; 3];
    for (index, word) in words.iter_mut().enumerate() {
        *word = u32::from_str_radix(&board[8 * index..8 * index + 8], 16).ok()?.swap_bytes();
    }
    let [first, second, third] = words;
    Some(format!("{:08X}{:04X}", first.wrapping_add(third), second >> 16))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Identifier and serial number of a part, as read in libopencm3's issue 760: words 002d0030 3334510b 32313533, 325e35633334.
    #[test]
    fn a_known_part_has_its_known_number() {
        assert_eq!(of_boot_loader("30002D000B51343333353132").as_deref(), Some("325E35633334"));
        // The sum carries beyond 32 bits.
        assert_eq!(of_boot_loader("FFFFFFFF0000CDAB02000000").as_deref(), Some("00000001ABCD"));
        for text in ["", "1-2", "325E35633334", "30002D000B5134333335313Z", "3000é2D00B51343333353132"] {
            assert_eq!(of_boot_loader(text), None, "{text}");
        }
    }
}
