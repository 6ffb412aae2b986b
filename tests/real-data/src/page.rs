//! A page of which one part is what a command prints.

/// Lines between which the printed part stands.
pub const MARKERS: [&str; 2] = ["<!-- printed: begin -->", "<!-- printed: end -->"];

/// The page with `printed` between its markers.
///
/// # Errors
/// When the markers are not there in their order.
pub fn with_printed(page: &str, printed: &str) -> Result<String, String> {
    let begin = page.find(MARKERS[0]).map(|place| place + MARKERS[0].len());
    let end = page.find(MARKERS[1]);
    match (begin, end) {
        (Some(begin), Some(end)) if begin <= end => {
            let (before, after) = (&page[..begin], &page[end..]);
            Ok(format!("{before}\n```text\n{}\n```\n{after}", printed.trim_end()))
        }
        _ => Err(format!("no lines `{}` and `{}`, expected both; put them back", MARKERS[0], MARKERS[1])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_stands_between_the_markers_is_replaced() {
        let page = "# A\n<!-- printed: begin -->\nold\n<!-- printed: end -->\nrest\n";
        let once = with_printed(page, "new\n\n").unwrap();
        assert_eq!(once, "# A\n<!-- printed: begin -->\n```text\nnew\n```\n<!-- printed: end -->\nrest\n");
        assert_eq!(with_printed(&once, "new").unwrap(), once);
        assert!(with_printed("# A\n<!-- printed: end --><!-- printed: begin -->", "new").is_err());
        assert!(with_printed("# A\n", "new").is_err());
    }
}
