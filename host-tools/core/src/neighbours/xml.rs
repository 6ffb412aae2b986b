//! XML with lines, and numbers in it.

use nalgebra::Vector3;
use roxmltree::{Document, Node};

use crate::outcome::Failure;

/// A parsed file under its name.
pub(super) struct Xml<'t> {
    pub(super) source: &'t str,
    pub(super) document: Document<'t>,
}

impl<'t> Xml<'t> {
    /// # Errors
    /// No XML, or another root than expected.
    pub(super) fn parse(text: &'t str, source: &'t str, root: &str) -> Result<Self, Failure> {
        let document = Document::parse(text).map_err(|error| {
            let at = error.pos();
            Failure::bad_input(format!("{source}:{}:{}: no XML: {error}; correct it", at.row, at.col))
        })?;
        let found = document.root_element().tag_name().name();
        if found != root {
            let reason = format!("got <{found}>, expected <{root}>; name a file of that kind");
            return Err(Failure::bad_input(format!("{source}:1: {reason}")));
        }
        Ok(Self { source, document })
    }

    pub(super) fn line(&self, node: Node) -> u32 {
        self.document.text_pos_at(node.range().start).row
    }

    pub(super) fn at(&self, node: Node, reason: impl std::fmt::Display) -> Failure {
        Failure::bad_input(format!("{}:{}: {reason}", self.source, self.line(node)))
    }

    /// The numbers of an attribute's text, as many as expected.
    pub(super) fn numbers<const N: usize>(
        &self,
        node: Node,
        name: &str,
        text: &str,
    ) -> Result<[f64; N], Failure> {
        let some = self.some_numbers(node, name, text)?;
        let got = some.len();
        <[f64; N]>::try_from(some)
            .map_err(|_| self.at(node, format!("{name}: got {got} numbers, expected {N}; correct it")))
    }

    /// All numbers of an attribute's text.
    pub(super) fn some_numbers(&self, node: Node, name: &str, text: &str) -> Result<Vec<f64>, Failure> {
        let number = |word: &str| {
            let finite = word.parse().ok().filter(|number: &f64| number.is_finite());
            finite
                .ok_or_else(|| self.at(node, format!("{name}: got `{word}`, expected a number; correct it")))
        };
        text.split_whitespace().map(number).collect()
    }

    pub(super) fn vector(&self, node: Node, name: &str, text: &str) -> Result<Vector3<f64>, Failure> {
        self.numbers::<3>(node, name, text).map(Vector3::from)
    }
}

/// Elements among the children.
pub(super) fn elements<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(Node::is_element)
}
