//! What the board needs of an ELF: flash image, code that runs from RAM, symbols, sizes.

use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SymbolKind};

use crate::error::BoardError;
use crate::memory_map::{CCM, CCM_BEHIND_SRAM2, FLASH, RAM, WRITABLE_FLASH};

/// A function or static of the image.
#[derive(Debug, Clone)]
pub(crate) struct Symbol {
    /// First byte; bit 0 of a function's address is clear.
    pub address: u32,
    /// Bytes.
    pub size: u32,
    /// Demangled name without hash.
    pub name: String,
}

/// Flash and RAM that the image takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageSizes {
    /// Bytes of flash: code, constants and initial values.
    pub flash_bytes: u32,
    /// Bytes of static data in RAM and CCM, without the stack.
    pub ram_bytes: u32,
    /// Bytes of code that are copied to RAM or CCM (part of `flash_bytes` and `ram_bytes`).
    pub ram_code_bytes: u32,
}

/// A loaded image.
#[derive(Debug, Clone)]
pub(crate) struct Image {
    /// Flash from its first byte, 0xff where nothing is programmed.
    pub flash: Vec<u8>,
    /// Code by the address it runs at: flash, and what start-up copies to RAM.
    pub code: Vec<(u32, Vec<u8>)>,
    /// Functions in the order of their addresses.
    pub functions: Vec<Symbol>,
    /// Statics in the order of their addresses.
    pub statics: Vec<Symbol>,
    /// Address of the RTT control block.
    pub rtt: Option<u32>,
    /// Whether the image has the CCM SRAM where it continues SRAM2, and not at its own address.
    pub ccm_behind_sram2: bool,
    /// Sizes.
    pub sizes: ImageSizes,
    /// Lowest address that the stack may grow down to: end of the static data under the initial stack pointer.
    pub stack_limit: u32,
    /// Initial stack pointer.
    pub stack_top: u32,
}

fn bad(text: impl Into<String>) -> BoardError {
    BoardError::Image(text.into())
}

impl Image {
    /// First address of the CCM SRAM, where the image has it.
    pub(crate) fn ccm_start(&self) -> u32 {
        if self.ccm_behind_sram2 { CCM_BEHIND_SRAM2 } else { CCM.start }
    }

    /// Reads an ELF for a 32-bit ARM.
    pub(crate) fn parse(elf: &[u8]) -> Result<Self, BoardError> {
        let file = object::File::parse(elf).map_err(|error| {
            bad(format!("{error}; expected an ELF, as cargo build leaves it under release/"))
        })?;
        if file.architecture() != object::Architecture::Arm {
            let got = file.architecture();
            return Err(bad(format!("it is for {got:?}, expected Arm: build for thumbv7em-none-eabihf")));
        }
        let mut flash = vec![0xff; FLASH.size as usize];
        let mut code = Vec::new();
        let mut flash_bytes = 0;
        for (virtual_address, physical, data) in loadable(elf)? {
            if data.is_empty() {
                continue;
            }
            let last = u64::from(physical) + data.len() as u64;
            if !FLASH.contains(physical) || last > u64::from(WRITABLE_FLASH.start) {
                return Err(bad(format!(
                    "a segment at {physical:#010x} of {} bytes is not below {:#010x}, where the parameter pages begin",
                    data.len(),
                    WRITABLE_FLASH.start
                )));
            }
            let from = (physical - FLASH.start) as usize;
            flash[from..from + data.len()].copy_from_slice(data);
            flash_bytes += data.len() as u32;
            code.push((virtual_address, data.to_vec()));
        }
        if flash_bytes == 0 {
            return Err(bad(
                "it has no segment in flash at 0x08000000: check memory.x and the linker script",
            ));
        }
        let word = |at: usize| u32::from_le_bytes([flash[at], flash[at + 1], flash[at + 2], flash[at + 3]]);
        let (stack_top, entry) = (word(0), word(4));
        if entry & 1 == 0 || !FLASH.contains(entry) {
            return Err(bad(format!("its reset vector is {entry:#010x}, expected an odd address in flash")));
        }
        let stack_memory =
            [RAM, CCM].into_iter().find(|region| stack_top > region.start && stack_top <= region.end());
        let Some(stack_memory) = stack_memory.filter(|_| stack_top % 4 == 0) else {
            return Err(bad(format!(
                "its initial stack pointer is {stack_top:#010x}, expected a word of RAM"
            )));
        };
        let (mut ram_bytes, mut ram_code_bytes, mut stack_limit) = (0, 0, stack_memory.start);
        let (mut ccm_behind_sram2, mut uses_ccm) =
            (stack_memory == RAM && stack_top > CCM_BEHIND_SRAM2, false);
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            let (allocated, executable) = (sh_flags & 2 != 0, sh_flags & 4 != 0);
            let (start, size) = (section.address() as u32, section.size() as u32);
            if !allocated || size == 0 || !(RAM.contains(start) || CCM.contains(start)) {
                continue;
            }
            uses_ccm |= CCM.contains(start);
            ccm_behind_sram2 |= RAM.contains(start) && start.saturating_add(size) > CCM_BEHIND_SRAM2;
            ram_bytes += size;
            ram_code_bytes += if executable { size } else { 0 };
            if start >= stack_memory.start && start < stack_top && start.saturating_add(size) <= stack_top {
                stack_limit = stack_limit.max(start + size);
            }
        }
        if uses_ccm && ccm_behind_sram2 {
            return Err(bad(format!(
                "it uses the CCM SRAM at {:#010x} and at {CCM_BEHIND_SRAM2:#010x}, which is the same memory: leave one out of memory.x",
                CCM.start
            )));
        }
        let functions = symbols(&file, SymbolKind::Text);
        let statics = symbols(&file, SymbolKind::Data);
        let rtt = file
            .symbols()
            .find(|symbol| symbol.name() == Ok("_SEGGER_RTT"))
            .map(|symbol| symbol.address() as u32);
        let sizes = ImageSizes { flash_bytes, ram_bytes, ram_code_bytes };
        Ok(Self { flash, code, functions, statics, rtt, ccm_behind_sram2, sizes, stack_limit, stack_top })
    }

    /// Whether the stack ends where a memory begins, so that a word more is a bus fault.
    pub(crate) fn nothing_below_stack(&self) -> bool {
        [RAM, CCM].iter().any(|region| region.start == self.stack_limit)
    }

    /// Name of the function that holds `address`.
    pub(crate) fn function_at(&self, address: u32) -> String {
        find(&self.functions, address & !1)
            .map_or_else(|| NO_SYMBOL.to_owned(), |function| function.name.clone())
    }

    /// Name of the static, else of the function, that holds `address`.
    pub(crate) fn symbol_at(&self, address: u32) -> String {
        let holder = find(&self.statics, address).or_else(|| find(&self.functions, address));
        holder.map_or_else(|| NO_SYMBOL.to_owned(), |symbol| symbol.name.clone())
    }
}

/// Stands for the name where no symbol holds an address.
const NO_SYMBOL: &str = "no symbol";

/// The symbol of `list`, which is in the order of addresses, that holds `address`.
fn find(list: &[Symbol], address: u32) -> Option<&Symbol> {
    let after = list.partition_point(|symbol| symbol.address <= address);
    list[..after].iter().rev().take(4).find(|symbol| address < symbol.address + symbol.size)
}

/// Symbols of `kind` with a size, by address.
fn symbols(file: &object::File, kind: SymbolKind) -> Vec<Symbol> {
    let mut list: Vec<Symbol> = file
        .symbols()
        .filter(|symbol| symbol.kind() == kind && symbol.size() > 0)
        .filter_map(|symbol| {
            let name = format!("{:#}", rustc_demangle::demangle(symbol.name().ok()?));
            let address = symbol.address() as u32 & if kind == SymbolKind::Text { !1 } else { !0 };
            Some(Symbol { address, size: symbol.size() as u32, name })
        })
        .collect();
    list.sort_by(|a, b| a.address.cmp(&b.address).then_with(|| a.name.cmp(&b.name)));
    list
}

/// Virtual address, physical address and content of a segment.
type Segment<'a> = (u32, u32, &'a [u8]);

/// The loadable segments.
fn loadable(elf: &[u8]) -> Result<Vec<Segment<'_>>, BoardError> {
    // The object crate's segment view leaves out the physical address, so the headers are read here.
    let half = |at: usize| elf.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]) as usize);
    let word = |at: usize| elf.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let cut = || bad("its program headers are cut off");
    let table = word(28).ok_or_else(cut)? as usize;
    let (size, count) = (half(42).ok_or_else(cut)?, half(44).ok_or_else(cut)?);
    let mut segments = Vec::new();
    for index in 0..count {
        let at = table + index * size;
        let field = |n: usize| word(at + 4 * n).ok_or_else(cut);
        if field(0)? != 1 {
            continue;
        }
        let (from, length) = (field(1)? as usize, field(4)? as usize);
        let data = elf.get(from..from + length).ok_or_else(cut)?;
        segments.push((field(2)?, field(3)?, data));
    }
    Ok(segments)
}
