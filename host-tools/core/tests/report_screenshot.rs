//! How report.html looks in a browser: the example of the report's own tests, in headless Chromium.
//!
//! Measured are width, order, size of letters, letters on letters, and ink in every figure. Pictures and the printed page
//! stay in `target/tmp/report`. Without Chromium the tests say so and pass.
#![cfg(unix)]

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

// The example speaks of `crate::diagnose`, as it does in the library.
use bowden_core::{diagnose, report};
use serde::Deserialize;

#[path = "../src/report/example.rs"]
mod example;

/// Widths that are tried, px: a laptop's window, and a telephone.
const WIDTHS: [u32; 2] = [1200, 400];

/// Height of the first screen, px.
const FIRST_SCREEN: f64 = 700.0;

/// Smallest letters that can be read, px.
const READABLE: f64 = 8.5;

/// Part of a figure that must be drawn on.
const INK: f64 = 0.004;

/// What the page says about itself.
#[derive(Clone, Debug, Deserialize)]
struct Measured {
    window: f64,
    content: f64,
    height: f64,
    verdict_bottom: f64,
    smallest_letters: f64,
    /// Pairs of words of one figure that lie on each other.
    collisions: Vec<String>,
    /// Left, top, width and height of every figure.
    figures: Vec<[f64; 4]>,
}

/// Asks the page, and leaves the answer in the body's attribute `data-measured`.
const SCRIPT: &str = r"<script>
  const all = (what, where) => [...(where || document).querySelectorAll(what)];
  const box = (element) => element.getBoundingClientRect();
  const collisions = [];
  for (const svg of all('svg')) {
    const words = all('text', svg).map((text) => [text.textContent, box(text)]);
    words.forEach(([a, p], i) => words.slice(i + 1).forEach(([b, q]) => {
      const wide = Math.min(p.right, q.right) - Math.max(p.left, q.left);
      const high = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
      if (wide > 1 && high > 0.35 * Math.min(p.height, q.height)) collisions.push(a + ' | ' + b);
    }));
  }
  const sizes = all('svg text').map((text) => parseFloat(getComputedStyle(text).fontSize) * text.getScreenCTM().a)
    .concat(all('p, td, th, dd, dt, li, code, figcaption').map((text) => parseFloat(getComputedStyle(text).fontSize)));
  parent.document.body.dataset.measured = JSON.stringify({
    window: innerWidth, content: document.documentElement.scrollWidth, height: document.documentElement.scrollHeight,
    verdict_bottom: box(document.getElementById('verdict')).bottom, smallest_letters: Math.min(...sizes), collisions,
    figures: all('figure svg').map(box).map((r) => [r.left, r.top, r.width, r.height]),
  });
</script>";

/// A browser and a folder of its own for one test.
struct Browser {
    program: PathBuf,
    folder: PathBuf,
}

impl Browser {
    /// `None`, with a line that says so, where there is no Chromium.
    fn find(test: &str) -> Option<Self> {
        let named = std::env::var_os("CHROMIUM").map(PathBuf::from);
        let path = std::env::var_os("PATH").unwrap_or_default();
        let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
        let installed = || {
            std::env::split_paths(&path)
                .flat_map(|folder| names.map(|name| folder.join(name)))
                .find(|p| p.is_file())
        };
        let Some(program) = named.or_else(installed) else {
            eprintln!("skipped: no Chromium in PATH, and CHROMIUM names none");
            return None;
        };
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report").join(test);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Some(Self { program, folder })
    }

    /// Writes a page and gives its address.
    fn page(&self, name: &str, text: &str) -> String {
        let path = self.folder.join(name);
        fs::write(&path, text).unwrap();
        format!("file://{}", path.display())
    }

    /// What the browser prints when asked to do `wanted` with the page at `address`.
    fn run(&self, address: &str, (width, height): (u32, u32), wanted: &str) -> String {
        let profile = self.folder.join("profile");
        let output = Command::new(&self.program)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
            .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
            .args(["--hide-scrollbars", "--force-device-scale-factor=1", "--virtual-time-budget=2000"])
            .args(["--no-pdf-header-footer"])
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg(format!("--window-size={width},{height}"))
            .args([wanted, address])
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let _ = fs::remove_dir_all(&profile);
        assert!(output.status.success(), "{}: {}", output.status, String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// A page in a frame of that width: a window has a least one of its own.
    fn framed(&self, name: &str, page: &str, (width, height): (u32, u32)) -> String {
        let quoted = page.replace('&', "&amp;").replace('"', "&quot;");
        let frame = format!(
            "<!DOCTYPE html><meta charset=\"utf-8\"><body style=\"margin:0\"><iframe srcdoc=\"{quoted}\" \
             style=\"display:block;border:0;width:{width}px;height:{height}px\"></iframe></body>"
        );
        self.page(name, &frame)
    }

    fn measure(&self, page: &str, width: u32) -> Measured {
        let asking = page.replacen("</body>", &format!("{SCRIPT}</body>"), 1);
        let screen = (width, FIRST_SCREEN as u32);
        let dom = self.run(&self.framed("asking.html", &asking, screen), screen, "--dump-dom");
        let (_, rest) = dom.split_once("data-measured=\"").expect("the page answers");
        let text = rest[..rest.find('"').unwrap()].replace("&quot;", "\"").replace("&amp;", "&");
        serde_json::from_str(&text).unwrap()
    }

    /// Picture of the whole page.
    fn picture(&self, page: &str, width: u32, height: u32) -> Picture {
        let file = self.folder.join(format!("report-{width}.png"));
        let address = self.framed("framed.html", page, (width, height));
        self.run(&address, (width, height), &format!("--screenshot={}", file.display()));
        Picture::read(&file)
    }
}

/// Pixels of a page, three bytes each.
struct Picture {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
    channels: usize,
}

impl Picture {
    fn read(path: &Path) -> Self {
        let mut reader = png::Decoder::new(BufReader::new(File::open(path).unwrap())).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!(info.bit_depth, png::BitDepth::Eight);
        let channels = info.color_type.samples();
        Self { width: info.width as usize, height: info.height as usize, bytes, channels }
    }

    /// Part of a rectangle of the page, cut at the picture's edge, that is clearly not white.
    fn ink(&self, [left, top, width, height]: [f64; 4]) -> f64 {
        let end = |from: f64, length: f64, most: usize| (((from + length).max(0.0)) as usize).min(most);
        let (columns, rows) = (
            left.max(0.0) as usize..end(left, width, self.width),
            top.max(0.0) as usize..end(top, height, self.height),
        );
        let (mut drawn, mut all) = (0.0, 0.0);
        for row in rows {
            for column in columns.clone() {
                let at = (row * self.width + column) * self.channels;
                all += 1.0;
                drawn += f64::from(u8::from(self.bytes[at..at + 3].iter().any(|byte| *byte < 160)));
            }
        }
        if all > 0.0 { drawn / all } else { 0.0 }
    }
}

#[test]
fn the_page_fits_its_window_and_every_figure_is_drawn() {
    let Some(browser) = Browser::find("looks") else { return };
    let page = report::render(&example::findings(40_000));
    for width in WIDTHS {
        let measured = browser.measure(&page, width);
        let figures = &measured.figures;
        let shown = Measured { figures: Vec::new(), ..measured.clone() };
        let shown = format!("{width} px: {shown:#?}");
        assert!((measured.window - f64::from(width)).abs() < 1.0, "{shown}");
        assert!(measured.content <= measured.window, "the page is wider than its window; {shown}");
        assert!(measured.verdict_bottom < FIRST_SCREEN, "the verdict leaves the first screen; {shown}");
        assert!(measured.smallest_letters >= READABLE, "letters too small; {shown}");
        assert!(measured.collisions.is_empty(), "words on words; {shown}");
        // Eight channels: one figure each of trace and regimes, four of the map; and the free form.
        assert_eq!(figures.len(), 8 * 6 + 1, "{shown}");
        let picture = browser.picture(&page, width, measured.height as u32);
        for figure in figures {
            let ink = picture.ink(*figure);
            assert!(ink > INK, "the figure at {figure:?} is blank: {ink}; {shown}");
        }
        // White where nothing is: the check for ink can fail.
        let margin = [0.0, measured.verdict_bottom + 20.0, 8.0, measured.height];
        assert!(picture.ink(margin) < 1e-6, "there is something in the margin");
    }
}

#[test]
fn a_page_with_little_in_it_fits_too() {
    let Some(browser) = Browser::find("little") else { return };
    let page = report::render(&example::consistent());
    for width in WIDTHS {
        let measured = browser.measure(&page, width);
        assert!(
            measured.content <= measured.window && measured.verdict_bottom < FIRST_SCREEN,
            "{measured:#?}"
        );
    }
}

#[test]
fn the_page_prints() {
    let Some(browser) = Browser::find("prints") else { return };
    let address = browser.page("report.html", &report::render(&example::findings(40_000)));
    let file = browser.folder.join("report.pdf");
    browser.run(&address, (1200, 900), &format!("--print-to-pdf={}", file.display()));
    let bytes = fs::read(&file).unwrap();
    assert!(bytes.starts_with(b"%PDF-"), "no PDF");
    // Pages of a PDF name themselves; their parent is called Pages.
    let text = String::from_utf8_lossy(&bytes);
    let pages = text.matches("/Type /Page").count() - text.matches("/Type /Pages").count();
    assert!((3..=12).contains(&pages), "{pages} pages");
}
