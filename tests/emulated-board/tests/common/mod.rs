//! Small programs for the board: an ELF around hand-assembled code.

/// Where the vector table stands.
pub const FLASH: u32 = 0x0800_0000;
/// Where code begins.
pub const CODE: u32 = FLASH + 0x200;
/// Initial stack pointer.
pub const STACK: u32 = 0x2000_1000;

/// Static data from the beginning of RAM.
pub const STATIC_BYTES: u32 = 0x400;

/// An ELF with `code` at [`CODE`], vectors as (exception number, offset into the code) and functions as (name, offset,
/// bytes). The reset vector points at offset 0.
pub fn elf(code: &[u16], vectors: &[(usize, u32)], functions: &[(&str, u32, u32)]) -> Vec<u8> {
    elf_beside(code, vectors, functions, STATIC_BYTES)
}

/// The same with `static_bytes` of static data from the beginning of RAM; with none, nothing is below the stack.
pub fn elf_beside(
    code: &[u16],
    vectors: &[(usize, u32)],
    functions: &[(&str, u32, u32)],
    static_bytes: u32,
) -> Vec<u8> {
    let mut flash = vec![0_u8; 0x200];
    let mut vector = |number: usize, value: u32| {
        flash[4 * number..4 * number + 4].copy_from_slice(&value.to_le_bytes());
    };
    vector(0, STACK);
    vector(1, CODE | 1);
    for (number, offset) in vectors {
        vector(*number, (CODE + offset) | 1);
    }
    flash.extend(code.iter().flat_map(|half| half.to_le_bytes()));

    let names = b"\0.text\0.symtab\0.strtab\0.shstrtab\0.bss\0";
    let mut strings = vec![0];
    let mut symbols = vec![0; 16];
    for (name, offset, size) in functions {
        let words = [strings.len() as u32, (CODE + offset) | 1, *size];
        symbols.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        symbols.extend([0x12, 0, 1, 0]);
        strings.extend(name.as_bytes());
        strings.push(0);
    }
    let text_at = 52 + 32;
    let symbols_at = text_at + flash.len();
    let strings_at = symbols_at + symbols.len();
    let names_at = strings_at + strings.len();
    let sections_at = names_at + names.len();

    let mut file = vec![0x7f, b'E', b'L', b'F', 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    let half = |file: &mut Vec<u8>, value: u16| file.extend(value.to_le_bytes());
    let words = |file: &mut Vec<u8>, values: &[u32]| {
        for value in values {
            file.extend(value.to_le_bytes());
        }
    };
    half(&mut file, 2);
    half(&mut file, 40);
    words(&mut file, &[1, CODE | 1, 52, sections_at as u32, 0x0500_0400]);
    for value in [52, 32, 1, 40, 6, 4] {
        half(&mut file, value);
    }
    words(&mut file, &[1, text_at as u32, FLASH, FLASH, flash.len() as u32, flash.len() as u32, 5, 4]);
    file.extend(&flash);
    file.extend(&symbols);
    file.extend(&strings);
    file.extend(names);
    words(&mut file, &[0; 10]);
    words(&mut file, &[1, 1, 6, FLASH, text_at as u32, flash.len() as u32, 0, 0, 4, 0]);
    words(&mut file, &[7, 2, 0, 0, symbols_at as u32, symbols.len() as u32, 3, 1, 4, 16]);
    words(&mut file, &[15, 3, 0, 0, strings_at as u32, strings.len() as u32, 0, 0, 1, 0]);
    words(&mut file, &[23, 3, 0, 0, names_at as u32, names.len() as u32, 0, 0, 1, 0]);
    words(&mut file, &[33, 8, 3, 0x2000_0000, names_at as u32, static_bytes, 0, 0, 4, 0]);
    file
}
