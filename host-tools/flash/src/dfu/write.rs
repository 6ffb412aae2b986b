//! An image into a board that is in its boot loader, from the first check to the jump into it.

use bowden_core::progress::Progress;

use super::client::Client;
use super::device::DfuDevice;
use super::layout::Layout;
use crate::error::FlashError;
use crate::image::{FLASH_START, Image};

/// Bytes that are read to learn whether they may be.
const TRIAL_BYTES: usize = 16;

/// Writes an image, reads it back, and starts it. Pages that the image does not take keep their content.
///
/// # Errors
/// See [`FlashError`]. After an error behind the first erased page the image is not whole.
pub fn write<D: DfuDevice>(device: &mut D, image: &Image, progress: &dyn Progress) -> Result<(), FlashError> {
    let memory = device.memory().to_owned();
    let layout = Layout::parse(&memory).ok_or_else(|| FlashError::OtherChip {
        found: format!("its boot loader calls its memory `{memory}`"),
    })?;
    let pages = layout.pages_of(image)?;
    let mut client = Client::new(device);
    client.idle()?;
    // A protected chip refuses this before anything is erased.
    client.read(FLASH_START, TRIAL_BYTES)?;
    client.idle()?;
    progress.stage("erasing", pages.len() as u64);
    for page in &pages {
        client.erase(page.start)?;
        progress.advance(1);
    }
    progress.stage("writing", image.bytes() as u64);
    for (address, block) in blocks(image, client.block_bytes()) {
        client.write(address, block)?;
        progress.advance(block.len() as u64);
    }
    progress.stage("verifying", image.bytes() as u64);
    for (address, block) in blocks(image, client.block_bytes()) {
        let found = client.read(address, block.len())?;
        compare(address, block, &found)?;
        progress.advance(block.len() as u64);
    }
    client.leave(FLASH_START)
}

/// The image in pieces of at most so many bytes, none of which crosses a multiple of them.
fn blocks(image: &Image, bytes: usize) -> impl Iterator<Item = (u32, &[u8])> {
    image.runs().iter().flat_map(move |run| {
        let first = (bytes - run.address as usize % bytes).min(run.bytes.len());
        let (head, rest) = run.bytes.split_at(first);
        let behind = run.address + first as u32;
        let rest = rest.chunks(bytes).enumerate();
        std::iter::once((run.address, head))
            .chain(rest.map(move |(index, block)| (behind + (index * bytes) as u32, block)))
    })
}

/// Says where what was read is not what was written.
///
/// # Errors
/// [`FlashError::Differs`], the first address.
pub(crate) fn compare(address: u32, written: &[u8], found: &[u8]) -> Result<(), FlashError> {
    match written.iter().zip(found).position(|(written, found)| written != found) {
        None => Ok(()),
        Some(at) => {
            Err(FlashError::Differs { address: address + at as u32, found: found[at], expected: written[at] })
        }
    }
}
