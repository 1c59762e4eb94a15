//! Lists of numbers in the text of an element.

use std::str::FromStr;

use roxmltree::Node;

use super::file::File;
use crate::error::Result;

impl<'a> File<'a> {
    /// The numbers in `node`, one by one: no room is made for what a count claims.
    pub(super) fn numbers<'s, T: FromStr>(
        &'s self,
        node: Node<'a, 'a>,
    ) -> impl Iterator<Item = Result<T>> + use<'s, 'a, T> {
        // Comments divide a text.
        let words = node.children().filter_map(|child| child.is_text().then(|| child.text()).flatten());
        words.flat_map(str::split_ascii_whitespace).map(move |word| {
            let wrong = || {
                let word: String = word.chars().take(20).collect();
                self.at(node, format!("<{}> has `{word}`, which is not a valid number", node.tag_name().name()))
            };
            word.parse().map_err(|_| wrong())
        })
    }

    /// The `N` numbers in `node`.
    pub(super) fn exactly<const N: usize>(&self, node: Node<'a, 'a>) -> Result<[f64; N]> {
        let mut all = [0.0; N];
        let mut count = 0;
        for number in self.numbers(node) {
            let place = all.get_mut(count);
            let place =
                place.ok_or_else(|| self.at(node, format!("<{}> has over {N} numbers", node.tag_name().name())))?;
            *place = number?;
            count += 1;
        }
        if count < N {
            return Err(self.at(node, format!("<{}> has {count} numbers of {N}", node.tag_name().name())));
        }
        Ok(all)
    }
}
