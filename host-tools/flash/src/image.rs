//! The image in an ELF: what of it goes into the flash, and whether it is for this board.

use bowden_core::outcome::Failure;
use object::LittleEndian;
use object::elf::{EM_ARM, ET_EXEC, FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader, SectionHeader, Sym};

/// First address of the flash (RM0440, memory organization).
pub const FLASH_START: u32 = 0x0800_0000;

/// Bytes of flash of the board's STM32G474RE.
pub const FLASH_BYTES: u32 = 512 << 10;

/// First address behind the image: the ripple table and the parameters follow, 12 KiB that are never erased.
pub const IMAGE_END: u32 = 0x0807_d000;

/// Bytes that the flash programs at once (RM0440, FLASH main features).
pub const WORD_BYTES: u32 = 8;

/// Value of an erased byte.
pub const ERASED: u8 = 0xff;

/// Addresses of RAM, where the stack may begin: SRAM1, SRAM2 and the two places of the CCM SRAM.
const RAM: [std::ops::RangeInclusive<u32>; 2] = [0x2000_0000..=0x2002_0000, 0x1000_0000..=0x1000_8000];

/// Section of the words of the firmware's log; of the board's images its firmware alone has it.
const LOG_SECTION: &[u8] = b".defmt";

/// Symbol of what the log's bytes are found by.
const RTT_SYMBOL: &[u8] = b"_SEGGER_RTT";

/// Bytes for consecutive addresses of the flash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// First address, a multiple of [`WORD_BYTES`].
    pub address: u32,
    /// The bytes, whole words; what the image leaves open is [`ERASED`].
    pub bytes: Vec<u8>,
}

impl Run {
    /// First address behind.
    pub fn end(&self) -> u32 {
        self.address + self.bytes.len() as u32
    }
}

/// An image that can be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    runs: Vec<Run>,
    rtt: Option<u32>,
}

/// Which images are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The board's firmware.
    Firmware,
    /// Anything that runs on the board.
    Any,
}

impl Image {
    /// Takes what goes into the flash out of `elf`, whose name is `name` in messages.
    ///
    /// # Errors
    /// Exit status 2: no ELF or a damaged one, for another processor or board, one that reaches the stored parameters, or one that
    /// is not of `kind`.
    pub fn parse(name: &str, elf: &[u8], kind: Kind) -> Result<Self, Failure> {
        let refuse = |what: String| Failure::bad_input(format!("{name}: {what}"));
        if !elf.starts_with(b"\x7fELF") {
            return Err(refuse("no ELF file; give the file that `cargo xtask firmware` names".to_owned()));
        }
        if elf.get(4) != Some(&1) || elf.get(5) != Some(&1) {
            return Err(refuse(
                "for another processor, expected 32-bit ARM; give the file that `cargo xtask firmware` names"
                    .to_owned(),
            ));
        }
        let contents = Contents::read(elf).map_err(|problem| refuse(problem.to_string()))?;
        if kind == Kind::Firmware && !contents.has_log {
            return Err(refuse(
                "not the board's firmware: it has no log (section .defmt); give `bowden-firmware`, or --other if it is meant".to_owned(),
            ));
        }
        let runs = runs(&contents.loads).map_err(|problem| refuse(problem.to_string()))?;
        check_vectors(&runs).map_err(|problem| refuse(problem.to_string()))?;
        Ok(Self { runs, rtt: contents.rtt })
    }

    /// What is written, in the order of the addresses; no two runs share a word.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Bytes that are written.
    pub fn bytes(&self) -> usize {
        self.runs.iter().map(|run| run.bytes.len()).sum()
    }

    /// Address of the control block of its log, if it has one.
    pub fn rtt(&self) -> Option<u32> {
        self.rtt
    }
}

/// Why an ELF is not taken, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
enum Problem {
    #[error("damaged ELF: {0}; build it again")]
    Damaged(String),
    #[error(
        "for another processor (ELF machine {0}), expected ARM; give the file that `cargo xtask firmware` names"
    )]
    Machine(u16),
    #[error("no program that can run by itself (ELF type {0}); give the file that the linker wrote")]
    Type(u16),
    #[error("nothing in it goes into the flash; give the file that `cargo xtask firmware` names")]
    Empty,
    #[error(
        "{bytes} bytes are for address {address:#010x}, the board's flash is {FLASH_START:#010x} to {:#010x}; give an image \
         of this board", FLASH_START + FLASH_BYTES - 1
    )]
    Elsewhere { address: u32, bytes: u32 },
    #[error(
        "it reaches address {0:#010x}, from {IMAGE_END:#010x} on the board keeps its parameters; make the image smaller"
    )]
    Store(u32),
    #[error("two parts of it are for address {0:#010x}; build it again")]
    Overlap(u32),
    #[error("no vector table at {FLASH_START:#010x}: {0}; give an image of this board")]
    Vectors(String),
}

/// A part of the file and the address that it goes to.
type Load<'e> = (u32, &'e [u8]);

/// What is read of an ELF.
struct Contents<'e> {
    loads: Vec<Load<'e>>,
    has_log: bool,
    rtt: Option<u32>,
}

impl<'e> Contents<'e> {
    fn read(elf: &'e [u8]) -> Result<Self, Problem> {
        let damaged = |error: object::Error| Problem::Damaged(error.to_string().to_lowercase());
        let header = FileHeader32::<LittleEndian>::parse(elf).map_err(damaged)?;
        let endian = LittleEndian;
        match (header.e_machine(endian), header.e_type(endian)) {
            (EM_ARM, ET_EXEC) => {}
            (EM_ARM, kind) => return Err(Problem::Type(kind)),
            (machine, _) => return Err(Problem::Machine(machine)),
        }
        let mut loads = Vec::new();
        for part in header.program_headers(endian, elf).map_err(damaged)? {
            if part.p_type(endian) == PT_LOAD && part.p_filesz(endian) > 0 {
                let cut = |()| Problem::Damaged("a part of the image lies behind the file's end".to_owned());
                loads.push((part.p_paddr(endian), part.data(endian, elf).map_err(cut)?));
            }
        }
        let sections = header.sections(endian, elf).map_err(damaged)?;
        let named = |section: &&object::elf::SectionHeader32<LittleEndian>| {
            sections.section_name(endian, section).ok() == Some(LOG_SECTION)
        };
        let has_log = sections.iter().find(named).is_some_and(|section| section.sh_size(endian) > 0);
        let symbols = sections.symbols(endian, elf, object::elf::SHT_SYMTAB).map_err(damaged)?;
        let rtt = symbols
            .iter()
            .find(|symbol| symbol.name(endian, symbols.strings()).ok() == Some(RTT_SYMBOL))
            .map(|symbol| symbol.st_value(endian));
        Ok(Self { loads, has_log, rtt })
    }
}

/// Whole words for the flash out of the parts of an ELF.
fn runs(loads: &[Load<'_>]) -> Result<Vec<Run>, Problem> {
    let mut loads = loads.to_vec();
    loads.sort_by_key(|(address, _)| *address);
    let mut runs: Vec<Run> = Vec::new();
    let mut end = 0;
    for (address, bytes) in loads {
        let behind = u64::from(address) + bytes.len() as u64;
        if address < FLASH_START || behind > u64::from(FLASH_START + FLASH_BYTES) {
            return Err(Problem::Elsewhere { address, bytes: bytes.len() as u32 });
        }
        if behind > u64::from(IMAGE_END) {
            return Err(Problem::Store(behind as u32 - 1));
        }
        if address < end {
            return Err(Problem::Overlap(address));
        }
        end = behind as u32;
        let first = address - address % WORD_BYTES;
        match runs.last_mut() {
            // Its last word was filled up.
            Some(run) if first <= run.end() => {
                run.bytes.resize((address - run.address) as usize, ERASED);
            }
            _ => runs.push(Run { address: first, bytes: vec![ERASED; (address - first) as usize] }),
        }
        if let Some(run) = runs.last_mut() {
            run.bytes.extend_from_slice(bytes);
            run.bytes.resize(run.bytes.len().next_multiple_of(WORD_BYTES as usize), ERASED);
        }
    }
    if runs.is_empty() { Err(Problem::Empty) } else { Ok(runs) }
}

/// Whether the processor can start it: stack pointer and reset vector at the flash's first address (`ARMv7-M`, exception vectors).
fn check_vectors(runs: &[Run]) -> Result<(), Problem> {
    let word = |at: usize| {
        let first = runs.first().filter(|run| run.address == FLASH_START)?;
        let bytes = first.bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    };
    let (Some(stack), Some(reset)) = (word(0), word(4)) else {
        return Err(Problem::Vectors("nothing is there".to_owned()));
    };
    if !RAM.iter().any(|ram| ram.contains(&stack)) {
        return Err(Problem::Vectors(format!("the stack would begin at {stack:#010x}, which is no RAM")));
    }
    let entry = reset & !1;
    if reset & 1 == 0 || !runs.iter().any(|run| (run.address..run.end()).contains(&entry)) {
        return Err(Problem::Vectors(format!("{reset:#010x} is no entry of the image")));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vectors with a stack at the end of the RAM, and code behind them.
    fn code(bytes: usize) -> Vec<u8> {
        let mut code = vec![0x5a; bytes];
        code[..8].copy_from_slice(&[0x00, 0x00, 0x02, 0x20, 0x09, 0x00, 0x00, 0x08]);
        code
    }

    /// Where the firmware puts its ripple table, the first of what it stores, is where an image ends.
    #[test]
    fn an_image_ends_where_the_firmware_stores() {
        let source = include_str!("../../../firmware/board/src/main.rs");
        let (_, place) = source.split_once("const TABLE_STORE: core::ops::Range<u32> = 0x").unwrap();
        let (offset, _) = place.split_once("..").unwrap();
        let offset = u32::from_str_radix(&offset.replace('_', ""), 16).unwrap();
        assert_eq!(FLASH_START + offset, IMAGE_END);
    }

    #[test]
    fn parts_become_runs_of_whole_words() {
        let code = code(21);
        // Initial values of variables follow in the middle of a word, a table stands apart.
        let data = [1, 2, 3];
        let table = [7; 5];
        let made = runs(&[(0x0800_0015, &data), (0x0800_0000, &code), (0x0800_0103, &table)]).unwrap();
        let mut first = code.clone();
        first.extend([1, 2, 3]);
        let second = [&[ERASED; 3][..], &table].concat();
        assert_eq!(
            made,
            [Run { address: 0x0800_0000, bytes: first }, Run { address: 0x0800_0100, bytes: second }]
        );
        assert_eq!(check_vectors(&made), Ok(()));
    }

    #[test]
    fn what_stands_outside_of_the_images_place_is_refused() {
        let code = code(16);
        let last = [0; 2];
        assert!(runs(&[(0x0800_0000, &code), (0x0807_cffe, &last)]).is_ok());
        let refusal = |address: u32| {
            runs(&[(0x0800_0000, &code), (address, &last)]).map_err(|problem| problem.to_string())
        };
        assert_eq!(
            refusal(0x0807_cfff).unwrap_err(),
            "it reaches address 0x0807d000, from 0x0807d000 on the board keeps its parameters; make the image smaller"
        );
        assert!(refusal(0x0807_e000).unwrap_err().contains("keeps its parameters"));
        for address in [0x2000_0000, 0x0807_ffff, 0x07ff_ffff, 0xffff_ffff] {
            let text = refusal(address).unwrap_err();
            assert!(
                text.ends_with("the board's flash is 0x08000000 to 0x0807ffff; give an image of this board"),
                "{text}"
            );
        }
        assert_eq!(
            refusal(0x0800_000f),
            Err("two parts of it are for address 0x0800000f; build it again".to_owned())
        );
        assert_eq!(runs(&[]), Err(Problem::Empty));
    }

    #[test]
    fn an_image_that_cannot_start_is_refused() {
        let check = |at: usize, word: u32| {
            let mut code = code(16);
            code[at..at + 4].copy_from_slice(&word.to_le_bytes());
            check_vectors(&[Run { address: FLASH_START, bytes: code }])
        };
        assert_eq!(check(0, 0x2000_8c00), Ok(()));
        for (at, word) in [(0, 0x2002_0004), (0, 0xffff_ffff), (4, 0x0800_0008), (4, 0x0800_0011)] {
            assert!(matches!(check(at, word), Err(Problem::Vectors(_))), "{at} {word:#x}");
        }
        let elsewhere = Run { address: FLASH_START + 8, bytes: code(16) };
        assert_eq!(check_vectors(&[elsewhere]), Err(Problem::Vectors("nothing is there".to_owned())));
    }
}
