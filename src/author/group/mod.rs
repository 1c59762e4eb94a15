//! Groups taxels into fields by rules.
//!
//! Rules are applied in order, each to the taxels of a body and the fields of earlier rules; see [`FieldRule`]. The result
//! can be written into the body's file.

mod chart_notes;
mod charts;
mod choose;
mod distances;
mod divide;
pub(super) mod painted;
mod patches;
mod rule;

use std::collections::{BTreeMap, BTreeSet, HashMap};

pub use charts::MAX_PLANE_DISTORTION;
pub use rule::{ChartWish, Each, FieldRule, Patches, Rows, Seeds, Wrap};

use crate::body::{Body, FieldSpec, MemberSpec};
use crate::error::{Error, Result, nearest};
use crate::field::{Unroller, unions};

/// Materials and painted attributes of a body's surfaces. Surfaces and triangles are numbered as in [`Body::surfaces`].
pub trait Painted {
    /// The names of all materials.
    fn materials(&self) -> Vec<String>;

    /// The material of `triangle`.
    fn material(&self, surface: usize, triangle: usize) -> Option<&str>;

    /// The names of all painted attributes with one number per vertex, as in a recipe.
    fn attributes(&self) -> Vec<String>;

    /// Attribute `name` at `barycentric` of `triangle`; `None` if the surface does not have it.
    fn attribute(&self, name: &str, surface: usize, triangle: usize, barycentric: [f64; 3]) -> Option<f64>;
}

/// The fields that rules made.
#[derive(Clone, Debug, Default)]
pub struct Grouping {
    /// The fields, a parent before its children.
    pub fields: Vec<FieldSpec>,
    /// Notes for the user, a line each: what was split, left out, or has no chart, and why.
    pub notes: Vec<String>,
}

/// Groups the taxels of `body` by `rules`; without rules, one field for each link.
///
/// ```
/// use somatic::{Body, author::group::group, bundled};
///
/// let body = Body::from_bytes("mat", bundled::MAT)?;
/// let rules = vec![serde_json::from_str(r#"{"name": "mat", "rows": {"of": 32}}"#).unwrap()];
/// let grouping = group(&body, &(), &rules)?;
/// assert_eq!((grouping.fields[0].name.as_str(), grouping.fields[64].name.as_str()), ("mat", "mat/row_64"));
/// # Ok::<(), somatic::Error>(())
/// ```
///
/// # Errors
/// A rule is inconsistent, names something that does not exist, or refuses a field that cannot have its chart. The message
/// begins with the number of the rule, from 1.
pub fn group(body: &Body, painted: &dyn Painted, rules: &[FieldRule]) -> Result<Grouping> {
    let mut grower = Grouper::new(body, painted);
    for (rule, number) in rules.iter().zip(1..) {
        grower.apply(rule).map_err(|e| e.at(format!("field rule {number}")))?;
    }
    if rules.is_empty() {
        grower.apply(&FieldRule { each: Some(Each::Link), ..FieldRule::default() })?;
    }
    grower.finish().map_err(|(rule, e)| e.at(format!("field rule {}", rule + 1)))
}

/// A field before its chart is computed.
#[derive(Clone)]
struct FieldDraft {
    spec: FieldSpec,
    chart: ChartWish,
    wrap: Wrap,
    u: Option<[f64; 3]>,
    /// Whether it exists only as a level of a longer name.
    is_level: bool,
    /// Index of the rule that made it.
    rule: usize,
}

/// Applies rules one by one, so that the caller can tell which one fails.
pub struct Grouper<'a> {
    body: &'a Body,
    painted: &'a dyn Painted,
    unroller: Unroller<'a>,
    /// Cached places of taxels on the surface.
    taxel_places: BTreeMap<usize, Option<(usize, usize, [f64; 3])>>,
    /// A parent before its children.
    made: Vec<FieldDraft>,
    index_of: HashMap<String, usize>,
    notes: Vec<String>,
    /// Fields with distorted charts, and their distortion.
    poor: Vec<(String, f64)>,
    /// Rules applied so far.
    applied: usize,
}

impl<'a> Grouper<'a> {
    /// For `body` with the materials and attributes `painted`. The body's own fields are ignored.
    #[must_use]
    pub fn new(body: &'a Body, painted: &'a dyn Painted) -> Self {
        Self {
            body,
            painted,
            unroller: Unroller::new(body),
            taxel_places: BTreeMap::new(),
            made: Vec::new(),
            index_of: HashMap::new(),
            notes: Vec::new(),
            poor: Vec::new(),
            applied: 0,
        }
    }

    /// Makes the fields of `rule`.
    ///
    /// # Errors
    /// The rule is inconsistent, names something that does not exist, selects no taxel, or makes a field whose name is taken.
    pub fn apply(&mut self, rule: &FieldRule) -> Result<()> {
        check(rule)?;
        let mut any = false;
        for (host, among) in self.hosts(rule)? {
            let chosen = self.choose(rule, &among)?;
            if chosen.is_empty() {
                continue;
            }
            any = true;
            let prefix = match (&host, &rule.name) {
                (Some(host), Some(name)) => Some(format!("{host}/{name}")),
                (host, name) => host.clone().or(name.clone()),
            };
            let children = self.divide(rule, &chosen)?;
            if let (Some(name), Some(_)) = (&prefix, &rule.name) {
                // The children's taxels are members without being listed, unless they have a weight.
                let below: BTreeSet<usize> = children.iter().flat_map(|(_, taxels)| taxels).copied().collect();
                let own = chosen.iter().copied().filter(|taxel| rule.weight.is_some() || !below.contains(taxel));
                self.add(name, &own.collect::<Vec<_>>(), rule)?;
            }
            for (child, taxels) in children {
                let name = prefix.as_ref().map_or(child.clone(), |prefix| format!("{prefix}/{child}"));
                self.add(&name, &taxels, rule)?;
            }
        }
        self.applied += 1;
        if any {
            Ok(())
        } else {
            Err(Error::failed("it chooses no taxel: nothing meets all of its conditions at once"))
        }
    }

    /// The fields to which `rule` is applied, with their taxels; or all taxels.
    fn hosts(&self, rule: &FieldRule) -> Result<Vec<(Option<String>, Vec<usize>)>> {
        let Some(globs) = &rule.within else {
            return Ok(vec![(None, (0..self.body.taxels.len()).collect())]);
        };
        let specs: Vec<FieldSpec> = self.made.iter().map(|made| made.spec.clone()).collect();
        let taxels = |ids: BTreeSet<u32>| ids.into_iter().filter_map(|id| self.body.taxel_index(id)).collect();
        let all = specs.iter().zip(unions(&specs)).filter(|(spec, _)| globs.matches(&spec.name));
        let hosts: Vec<_> = all.map(|(spec, ids)| (Some(spec.name.clone()), taxels(ids))).collect();
        if hosts.is_empty() {
            let asked = globs.text().join("`, `");
            let hint = match nearest(&asked, specs.iter().map(|spec| spec.name.as_str())) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("there are {} so far, and rules see only those before them", specs.len()),
            };
            return Err(Error::failed(format!("`within`: no field matches `{asked}`: {hint}")));
        }
        Ok(hosts)
    }

    /// Adds the field `name` with the levels above it.
    fn add(&mut self, name: &str, taxels: &[usize], rule: &FieldRule) -> Result<()> {
        for name in [Some(name), rule.parent.as_deref()].into_iter().flatten() {
            if name.split('/').any(|level| level.trim().is_empty()) {
                return Err(Error::failed(format!("`{name}` is no name for a field: a level of it is empty")));
            }
        }
        let above = self.top(name, rule)?;
        let parent = self.add_levels(name, above);
        let member = MemberSpec { weight: rule.weight.unwrap_or(1.0), uv: None };
        let members = taxels.iter().map(|&taxel| (self.body.taxels[taxel].id, member)).collect();
        let spec = FieldSpec { name: name.to_owned(), parent, members, chart: None };
        let chart = rule.chart.unwrap_or_default();
        let named = if matches!(chart, ChartWish::Auto | ChartWish::None) { Wrap::Bare } else { Wrap::Refuse };
        let made = FieldDraft {
            spec,
            chart,
            wrap: rule.wrap.unwrap_or(named),
            u: rule.u,
            is_level: false,
            rule: self.applied,
        };
        match self.index_of.get(name) {
            Some(&there) if self.made[there].is_level => {
                let above = self.made[there].spec.parent.take();
                self.made[there] = made;
                self.made[there].spec.parent = self.made[there].spec.parent.take().or(above);
            }
            Some(_) => {
                return Err(Error::failed(format!(
                    "it makes a field `{name}`, and there is one of that name; give it another `name` or `stem`"
                )));
            }
            None => self.push(made),
        }
        Ok(())
    }

    /// The parent of the topmost level of `name`, which is added if it does not exist.
    fn top(&mut self, name: &str, rule: &FieldRule) -> Result<Option<String>> {
        let Some(parent) = &rule.parent else { return Ok(None) };
        let top = name.split('/').next().unwrap_or(name);
        if parent.split('/').next() == Some(top) {
            return Err(Error::failed(format!("`parent`: `{top}` cannot stand below itself")));
        }
        if let Some(&there) = self.index_of.get(top) {
            let above = self.made[there].spec.parent.as_deref();
            if above != Some(parent) {
                let above = above.map_or("nothing".to_owned(), |above| format!("`{above}`"));
                return Err(Error::failed(format!(
                    "`parent`: `{top}` stands below {above} since an earlier rule, and cannot be below `{parent}` as well"
                )));
            }
        }
        let above = self.add_levels(parent, None);
        self.add_level(parent, above);
        Ok(Some(parent.clone()))
    }

    /// Adds the levels above `name`, the topmost below `above`. Returns the parent of `name`.
    fn add_levels(&mut self, name: &str, above: Option<String>) -> Option<String> {
        let mut parent = above;
        for level in name.match_indices('/').map(|(end, _)| &name[..end]) {
            self.add_level(level, parent);
            parent = Some(level.to_owned());
        }
        parent
    }

    /// Adds the field `name` without members of its own, unless it exists.
    fn add_level(&mut self, name: &str, parent: Option<String>) {
        if self.index_of.contains_key(name) {
            return;
        }
        let spec = FieldSpec { name: name.to_owned(), parent, ..FieldSpec::default() };
        let (chart, wrap) = (ChartWish::Auto, Wrap::Bare);
        self.push(FieldDraft { spec, chart, wrap, u: None, is_level: true, rule: self.applied });
    }

    fn push(&mut self, made: FieldDraft) {
        self.index_of.insert(made.spec.name.clone(), self.made.len());
        self.made.push(made);
    }
}

/// Checks that `rule` is consistent by itself.
fn check(rule: &FieldRule) -> Result<()> {
    let wrong = |what: &str| Err(Error::failed(what));
    let discs = rule.radius.is_some() || rule.seeds.is_some() || rule.overlap.is_some();
    let divisions = [rule.each.is_some(), rule.patches.is_some(), discs, rule.rows.is_some(), rule.columns.is_some()];
    let divides = divisions.into_iter().filter(|&given| given).count();
    if divides > 1 {
        return wrong(
            "it divides in several ways: keep one of `each`, `patches`, `radius` with `seeds` or `overlap`, `rows` and \
             `columns`, and divide further by a rule `within` what this one makes",
        );
    }
    if divides == 0 && rule.name.is_none() {
        return wrong("it makes nothing: give it a `name`, or `each`, `patches`, `radius`, `rows` or `columns`");
    }
    if matches!(rule.patches, Some(Patches::Number(0) | Patches::Of { of: 0 })) {
        return wrong("`patches`: 0 makes no sense; ask for 1 or more");
    }
    if rule.parent.is_some() && rule.within.is_some() {
        return wrong("`parent` means nothing beside `within`, whose fields its own stand below; remove one");
    }
    if rule.rows.or(rule.columns).is_some_and(|rows| rows.of == 0 || rows.stride == Some(0)) {
        return wrong("`of` and `stride` of rows count from 1");
    }
    if rule.overlap.is_some_and(|overlap| !(0.0..1.0).contains(&overlap)) {
        return wrong("`overlap` is a share of a disc's width, from 0 to under 1");
    }
    if discs && (rule.radius.is_none() && (rule.seeds.is_none() || rule.overlap.is_none())) {
        return wrong("discs need a `radius`, or `seeds` and an `overlap`");
    }
    if discs && rule.seeds.is_none() && rule.overlap.is_none() {
        return wrong("discs of a `radius` need `seeds`, or the `overlap` at which they are to be spread");
    }
    if rule.radius.is_some() && rule.seeds.is_some() && rule.overlap.is_some() {
        return wrong("`radius`, `seeds` and `overlap` together say one thing too many; leave one of them out");
    }
    if rule.weight.is_some_and(|weight| !(weight.is_finite() && (1e-6..=1e6).contains(&weight))) {
        return wrong("`weight` lies between 1e-6 and 1e6");
    }
    if rule.u.is_some_and(|u| !u.iter().all(|x| x.is_finite()) || u == [0.0; 3]) {
        return wrong("`u` is a direction [x, y, z], and not all 0");
    }
    Ok(())
}
