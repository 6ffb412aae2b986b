//! The page about the first hour as tests run it: its commands, and what its checks of this machine may find.

/// The page.
pub const PAGE: &str = include_str!("../../docs/first-hour.md");

/// Blocks of commands of the page, but for those that need a board's probe.
pub fn blocks() -> Vec<Vec<&'static str>> {
    let mut blocks = Vec::new();
    let mut lines = PAGE.lines();
    while lines.by_ref().any(|line| line == "```sh") {
        blocks
            .push(lines.by_ref().take_while(|line| *line != "```").filter(|line| !line.is_empty()).collect());
    }
    blocks.retain(|block: &Vec<&str>| {
        let with_a_probe = block[0].starts_with("# with a board");
        let needs_none = |line: &&str| line.starts_with("bowden ") && !line.starts_with("bowden flash ");
        assert!(!with_a_probe || !block.iter().any(needs_none), "{block:?}");
        !with_a_probe
    });
    blocks
}

/// Arguments of a line behind `bowden`: words, with quotes around those that have spaces; a comment or redirection ends it. `port` takes
/// the place of `auto`.
pub fn arguments(line: &str, port: &[&str]) -> Vec<String> {
    let mut words = Vec::new();
    let mut quoted = false;
    let mut word = String::new();
    for c in line.chars().chain([' ']) {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => words.extend((!word.is_empty()).then(|| std::mem::take(&mut word))),
            c => word.push(c),
        }
    }
    let end = words.iter().position(|word| word == "#" || word == ">").unwrap_or(words.len());
    words.truncate(end);
    assert_eq!(words.first().map(String::as_str), Some("bowden"), "{line}");
    let replaced = |word: String| match word.as_str() {
        "auto" => port.iter().map(|word| (*word).to_owned()).collect(),
        _ => vec![word],
    };
    words.drain(1..).flat_map(replaced).collect()
}

/// Exit status that a line of the page has to have, by what it prints: 0, but for `doctor` on a machine with a probe or a port that this
/// user may not open, which is no fault of the page.
pub fn expected_status(line: &str, stdout: &str) -> i32 {
    if !line.starts_with("bowden doctor") {
        return 0;
    }
    let wrong = wrong(stdout);
    assert!(wrong.iter().all(|subject| ["probe", "port"].contains(subject)), "{line}\n{stdout}");
    i32::from(!wrong.is_empty())
}

/// Subjects that `bowden doctor` finds wrong.
pub fn wrong(stdout: &str) -> Vec<&str> {
    let found = stdout.lines().filter_map(|line| line.strip_prefix("WRONG  "));
    found.map(|line| line.split(':').next().unwrap_or_default()).collect()
}

/// Held-out losses before and after in "held-out loss ... from A to B".
pub fn losses(text: &str) -> [f64; 2] {
    let after = text.split("the held-out loss").nth(1).unwrap();
    let mut numbers =
        after.split_whitespace().filter_map(|word| word.trim_end_matches(['.', ',']).parse::<f64>().ok());
    [numbers.next().unwrap(), numbers.next().unwrap()]
}
