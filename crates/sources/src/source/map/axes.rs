//! Taxels with three axes: which value of a message is along which.

use std::str::FromStr;

use crate::error::{Error, Result, failed};
use crate::signal::{Axis, Channel};

/// How the three values of each taxel lie among those of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::source) struct Axes {
    /// What the first, the second and the third is along, and the sign by which it is multiplied.
    order: [(Axis, f64); 3],
    /// Whether each path has one axis, so that three paths are one pad's; else the three values of a taxel follow each other.
    is_apart: bool,
}

/// The channel of a value, and its sign.
pub(in crate::source) type Signed = (u32, f64);

impl FromStr for Axes {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let bad = || {
            failed!(
                "`{text}` does not name n, u and v once each; write them as uvn where the three values of a taxel follow each \
                 other, as u,v,n where each path has one of them, with - before one that points the other way"
            )
        };
        let is_apart = text.contains(',');
        let mut order = Vec::new();
        let mut sign = 1.0;
        for letter in text.chars().filter(|letter| !matches!(letter, ',' | ' ')) {
            let axis = match letter {
                '-' if sign > 0.0 => {
                    sign = -1.0;
                    continue;
                }
                'n' => Axis::Normal,
                'u' => Axis::U,
                'v' => Axis::V,
                _ => return Err(bad()),
            };
            order.push((axis, std::mem::replace(&mut sign, 1.0)));
        }
        let order: [(Axis, f64); 3] = order.try_into().map_err(|_| bad())?;
        let is_there = |axis: Axis| order.iter().any(|(own, _)| *own == axis);
        let is_whole = [Axis::Normal, Axis::U, Axis::V].into_iter().all(is_there) && sign > 0.0;
        if is_whole { Ok(Self { order, is_apart }) } else { Err(bad()) }
    }
}

impl Axes {
    /// Checks that `paths` of values go with it.
    ///
    /// # Errors
    /// Each path has one axis, and they are not three for each pad.
    pub(in crate::source) fn check(&self, paths: usize, pads: usize) -> Result<()> {
        let groups = paths / 3;
        if !self.is_apart || (paths.is_multiple_of(3) && (pads == 0 || groups == 1 || pads == groups)) {
            return Ok(());
        }
        let given = if paths == 1 { "there is one path".to_owned() } else { format!("there are {paths} paths") };
        Err(failed!(
            "with commas each path of values has one axis, so that a pad needs three, and {given}; without commas one path has all"
        ))
    }

    /// The taxels of `values` values.
    ///
    /// # Errors
    /// They are not three for each.
    pub(in crate::source) fn taxels(values: usize) -> Result<usize> {
        match values.is_multiple_of(3) {
            true => Ok(values / 3),
            false => Err(failed!("axes: {values} values are not three for each taxel")),
        }
    }

    /// What each value is, of messages with the `taxels` in pads of `sizes` taxels; `paths` are those of values.
    ///
    /// # Errors
    /// The taxels cannot be shared by the paths.
    pub(in crate::source) fn channels(&self, taxels: &[u32], paths: usize, sizes: &[usize]) -> Result<Vec<Signed>> {
        let signed = |taxel: u32, (axis, sign): (Axis, f64)| (Channel::of_taxel(taxel, axis).0, sign);
        if !self.is_apart {
            return Ok(taxels.iter().flat_map(|&taxel| self.order.map(|own| signed(taxel, own))).collect());
        }
        let groups = (paths / 3).max(1);
        let equal = vec![taxels.len() / groups; groups];
        let sizes = if sizes.len() == groups { sizes } else { &equal };
        if sizes.iter().sum::<usize>() != taxels.len() {
            return Err(failed!(
                "axes: {} taxels cannot be shared by {paths} paths of values; give a pad for each three",
                taxels.len()
            ));
        }
        let mut rest = taxels;
        let mut all = Vec::with_capacity(3 * taxels.len());
        for &size in sizes {
            let (own, after) = rest.split_at(size);
            rest = after;
            all.extend(self.order.iter().flat_map(|&axis| own.iter().map(move |&taxel| signed(taxel, axis))));
        }
        Ok(all)
    }
}

/// The taxels with three axes among the channels of a body, ascending.
pub(in crate::source) fn with_axes(channels: &[u32]) -> Vec<u32> {
    let mut taxels: Vec<u32> =
        Channel::taxels_of(channels).into_iter().filter(|&(_, has_axes)| has_axes).map(|(taxel, _)| taxel).collect();
    taxels.sort_unstable();
    taxels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(axes: &str, taxels: &[u32], paths: usize, sizes: &[usize]) -> String {
        let all = axes.parse::<Axes>().unwrap().channels(taxels, paths, sizes).unwrap();
        let name = |&(channel, sign): &Signed| format!("{}{}", if sign < 0.0 { "-" } else { "" }, Channel(channel));
        all.iter().map(name).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn values_are_of_their_taxels_and_axes() {
        assert_eq!(names("uvn", &[4, 7], 1, &[]), "4.u 4.v 4 7.u 7.v 7");
        assert_eq!(names("u, v, -n", &[4, 7], 3, &[]), "4.u 7.u 4.v 7.v -4 -7");
        assert_eq!(names("n,u,v", &[4, 7, 9], 6, &[1, 2]), "4 4.u 4.v 7 9 7.u 9.u 7.v 9.v");
        assert_eq!(with_axes(&[7, Channel::named("7.u").unwrap().0, 4, Channel::named("5.v").unwrap().0]), [5, 7]);
    }

    #[test]
    fn what_is_no_order_of_axes_is_said_in_a_line() {
        for wrong in ["", "uv", "uvnn", "uvu", "xyz", "--uvn", "uvn-"] {
            let why = wrong.parse::<Axes>().unwrap_err().to_string();
            assert!(why.contains("does not name n, u and v once each") && why.lines().count() == 1, "{wrong}: {why}");
        }
        let apart: Axes = "u,v,n".parse().unwrap();
        assert!(apart.check(3, 0).is_ok() && apart.check(6, 2).is_ok() && apart.check(3, 5).is_ok());
        assert!(apart.check(2, 0).is_err() && apart.check(6, 3).is_err());
        assert!("uvn".parse::<Axes>().unwrap().check(2, 5).is_ok());
        assert!(apart.channels(&[1, 2, 3], 6, &[]).unwrap_err().to_string().contains("cannot be shared by 6 paths"));
        assert!(Axes::taxels(7).unwrap_err().to_string().contains("7 values are not three for each taxel"));
    }
}
