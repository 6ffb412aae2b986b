//! `cargo xtask firmware`: release images for the joint driver board.

use std::path::PathBuf;
use std::process::Command;

use crate::cross_target::{self, TARGET};
use crate::image_size::ImageSize;
use crate::memory_map;
use crate::process::{self, cargo, target_folder, workspace};

/// An image: folder in the workspace, its package and binary, and the variable by which tests find it.
#[derive(Debug, Clone, Copy)]
struct Source {
    folder: &'static str,
    package: &'static str,
    variable: &'static str,
}

const SOURCES: [Source; 2] = [
    Source { folder: "firmware/board", package: "bowden-firmware", variable: "BOWDEN_FIRMWARE_ELF" },
    Source { folder: "firmware/measure", package: "bowden-measure", variable: "BOWDEN_MEASURE_ELF" },
];

/// Packages of the images.
pub fn packages() -> [&'static str; 2] {
    SOURCES.map(|source| source.package)
}

/// A release image.
#[derive(Debug)]
pub struct Image {
    source: Source,
    path: PathBuf,
}

/// Tells a program where the images are.
pub fn announce(images: &[Image], command: &mut Command) {
    command.envs(images.iter().map(|image| (image.source.variable, &image.path)));
}

/// Builds the images and prints what they take of the board's memory.
///
/// # Errors
/// When the target is missing, one does not build, or one does not fit.
pub fn run() -> Result<(), String> {
    cross_target::ensure()?;
    build().map(drop)
}

/// The same where the target is known to be there.
///
/// # Errors
/// When an image does not build or does not fit.
pub fn build() -> Result<Vec<Image>, String> {
    let memory = memory_map::read(&workspace().join("memory.x"))?;
    let mut images = Vec::new();
    for source in SOURCES {
        process::run(&mut cargo_for(source, "build")?, &[0])?;
        let path = target_folder()?.join(TARGET).join("release").join(source.package);
        let size = ImageSize::read(&path, &memory)?;
        println!("{}: {}\n  {size}", source.package, path.display());
        images.push(Image { source, path });
    }
    Ok(images)
}

/// Checks the images' source with clippy; warnings are errors.
///
/// # Errors
/// When there is one.
pub fn clippy() -> Result<(), String> {
    for source in SOURCES {
        process::run(cargo_for(source, "clippy")?.args(["--", "-D", "warnings"]), &[0])?;
    }
    Ok(())
}

/// A cargo command in the image's folder, whose configuration holds there only: linker scripts, profile, log level.
fn cargo_for(source: Source, subcommand: &str) -> Result<Command, String> {
    let mut command = cargo(&[subcommand, "--release", "--package", source.package, "--target", TARGET]);
    command.arg("--target-dir").arg(target_folder()?).current_dir(workspace().join(source.folder));
    // They would replace the configuration's flags, and an image without linker scripts is empty.
    for variable in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS"] {
        command.env_remove(variable);
    }
    Ok(command)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn each_image_has_its_own_configuration_for_the_linker() {
        for source in SOURCES {
            let folder = workspace().join(source.folder);
            let read = |file: &str| std::fs::read_to_string(folder.join(file)).unwrap();
            assert!(read("Cargo.toml").contains(&format!("name = \"{}\"", source.package)));
            assert!(read(".cargo/config.toml").contains("-Tlink.x"), "{}", source.folder);
        }
    }

    #[test]
    fn programs_are_told_where_the_images_are() {
        let image = |source: Source| Image { source, path: Path::new("/t").join(source.package) };
        let mut command = Command::new("true");
        announce(&SOURCES.map(image), &mut command);
        let set: Vec<_> =
            command.get_envs().map(|(key, value)| (key.to_owned(), value.unwrap().to_owned())).collect();
        assert_eq!(
            set,
            [
                ("BOWDEN_FIRMWARE_ELF".into(), "/t/bowden-firmware".into()),
                ("BOWDEN_MEASURE_ELF".into(), "/t/bowden-measure".into())
            ]
        );
    }
}
