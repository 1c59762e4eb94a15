//! Applies rules in order.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::halves::Halves;
use super::link_names::link_names;
use super::painted::Painted;
use super::rule::{ChartWish, FieldRule, Wrap};
use crate::body::{Body, FieldSpec, MemberSpec};
use crate::error::{Error, Result, failed, suggestion};
use crate::field::{Unroller, unions};
use crate::limits::{MAX_FIELDS, MAX_MEMBERS};
use crate::link_pairs::LinkPairs;

/// The fields that rules made.
#[derive(Clone, Debug, Default)]
pub struct Grouping {
    /// The fields, a parent before its children.
    pub fields: Vec<FieldSpec>,
    /// Notes for the user, a line each: what was split, left out, or has no chart, and why.
    pub notes: Vec<String>,
}

/// Groups the taxels of `body` by `rules`. Without rules, there is a field for each link, and below it patches of about twelve
/// taxels, equal in number, that have charts.
///
/// ```
/// use somatic_author::group::group;
/// use somatic_bodies as bundled;
/// use somatic_skin::body::Body;
///
/// let body = Body::from_bytes("mat", bundled::MAT)?;
/// let rules = vec![serde_json::from_str(r#"{"name": "mat", "rows": {"of": 32}}"#).unwrap()];
/// let grouping = group(&body, &(), &rules)?;
/// assert_eq!((grouping.fields[0].name.as_str(), grouping.fields[64].name.as_str()), ("mat", "mat/row_64"));
/// # Ok::<(), somatic_skin::Error>(())
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
        grower.apply_usual()?;
    }
    grower.finish().map_err(|(rule, e)| e.at(format!("field rule {}", rule + 1)))
}

/// A field to which a rule is applied, and its taxels.
type Host = (Option<String>, Option<Vec<usize>>);

/// A field before its chart is computed.
#[derive(Clone)]
pub(super) struct FieldDraft {
    pub(super) spec: FieldSpec,
    pub(super) chart: ChartWish,
    pub(super) wrap: Wrap,
    pub(super) u: Option<[f64; 3]>,
    /// Whether it exists only as a level of a longer name.
    pub(super) is_level: bool,
    pub(super) rule: usize,
}

/// Applies rules one by one, so that the caller can tell which one fails.
pub struct Grouper<'a> {
    pub(super) body: &'a Body,
    pub(super) painted: &'a dyn Painted,
    pub(super) unroller: Unroller<'a>,
    /// What fields of links are called.
    pub(super) link_names: Vec<String>,
    pub(super) pairs: LinkPairs,
    /// Taxels that are mirror images of each other.
    pub(super) halves: Halves,
    /// Cached places of taxels on the surface.
    pub(super) taxel_places: BTreeMap<usize, Option<(usize, usize, [f64; 3])>>,
    /// A parent before its children.
    pub(super) made: Vec<FieldDraft>,
    index_of: HashMap<String, usize>,
    pub(super) notes: Vec<String>,
    applied: usize,
    /// Members of all fields so far.
    memberships: usize,
}

impl<'a> Grouper<'a> {
    /// For `body` with the materials and attributes `painted`. The body's own fields are ignored.
    #[must_use]
    pub fn new(body: &'a Body, painted: &'a dyn Painted) -> Self {
        Self {
            body,
            painted,
            unroller: Unroller::new(body),
            link_names: link_names(body),
            pairs: LinkPairs::new(body),
            halves: Halves::default(),
            taxel_places: BTreeMap::new(),
            made: Vec::new(),
            index_of: HashMap::new(),
            notes: Vec::new(),
            applied: 0,
            memberships: 0,
        }
    }

    /// The same with taxels that are mirror images of each other, by ids, each the left one and the right one: patches are made on the
    /// left, and mirrored.
    pub(crate) fn with_pairs(self, pairs: &[[u32; 2]]) -> Self {
        Self { halves: Halves::new(self.body, pairs), ..self }
    }

    /// Makes the fields of `rule`.
    ///
    /// # Errors
    /// The rule is inconsistent, names something that does not exist, selects no taxel, or makes a field whose name is taken.
    pub fn apply(&mut self, rule: &FieldRule) -> Result<()> {
        rule.check()?;
        let mut any = false;
        for (host, among) in self.hosts(rule)? {
            let chosen = self.choose(rule, among.as_deref())?;
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

    /// The fields to which `rule` is applied, with their taxels, ascending; or no field and `None` for all taxels.
    fn hosts(&self, rule: &FieldRule) -> Result<Vec<Host>> {
        let Some(globs) = &rule.within else { return Ok(vec![(None, None)]) };
        let specs: Vec<FieldSpec> = self.made.iter().map(|made| made.spec.clone()).collect();
        let taxels = |ids: BTreeSet<u32>| ids.into_iter().filter_map(|id| self.body.taxel_index(id)).collect();
        let all = specs.iter().zip(unions(&specs)).filter(|(spec, _)| globs.matches(&spec.name));
        let hosts: Vec<Host> = all.map(|(spec, ids)| (Some(spec.name.clone()), Some(taxels(ids)))).collect();
        if hosts.is_empty() {
            let asked = globs.listed();
            let hint = suggestion(&asked, specs.iter().map(|spec| spec.name.as_str()));
            return Err(failed!("`within`: no field of an earlier rule matches `{asked}`; {hint}"));
        }
        Ok(hosts)
    }

    /// Adds the field `name` with the levels above it.
    pub(super) fn add(&mut self, name: &str, taxels: &[usize], rule: &FieldRule) -> Result<()> {
        for name in [Some(name), rule.parent.as_deref()].into_iter().flatten() {
            if name.split('/').any(|level| level.trim().is_empty()) {
                return Err(failed!("`{name}` is not a name for a field: a level of it is empty"));
            }
        }
        let above = self.top(name, rule)?;
        let parent = self.add_levels(name, above)?;
        self.memberships += taxels.len();
        if self.memberships > MAX_MEMBERS {
            return Err(failed!("the fields have over {MAX_MEMBERS} members together; choose fewer taxels for each"));
        }
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
                return Err(failed!(
                    "it makes a field `{name}`, and there is one of that name; give it another `name` or `stem`"
                ));
            }
            None => self.push(made)?,
        }
        Ok(())
    }

    /// The parent of the topmost level of `name`, which is added if it does not exist.
    fn top(&mut self, name: &str, rule: &FieldRule) -> Result<Option<String>> {
        let Some(parent) = &rule.parent else { return Ok(None) };
        let top = name.split('/').next().unwrap_or(name);
        if parent.split('/').next() == Some(top) {
            return Err(failed!("`parent`: `{top}` cannot be below itself"));
        }
        if let Some(&there) = self.index_of.get(top) {
            let above = self.made[there].spec.parent.as_deref();
            if above != Some(parent) {
                let above = above.map_or("nothing".to_owned(), |above| format!("`{above}`"));
                return Err(failed!(
                    "`parent`: `{top}` is below {above} since an earlier rule, and cannot be below `{parent}` as well"
                ));
            }
        }
        let above = self.add_levels(parent, None)?;
        self.add_level(parent, above)?;
        Ok(Some(parent.clone()))
    }

    /// Adds the levels above `name`, the topmost below `above`. Returns the parent of `name`.
    fn add_levels(&mut self, name: &str, above: Option<String>) -> Result<Option<String>> {
        let mut parent = above;
        for level in name.match_indices('/').map(|(end, _)| &name[..end]) {
            self.add_level(level, parent)?;
            parent = Some(level.to_owned());
        }
        Ok(parent)
    }

    /// Adds the field `name` without members of its own, unless it exists.
    fn add_level(&mut self, name: &str, parent: Option<String>) -> Result<()> {
        if self.index_of.contains_key(name) {
            return Ok(());
        }
        let spec = FieldSpec { name: name.to_owned(), parent, ..FieldSpec::default() };
        let (chart, wrap) = (ChartWish::Auto, Wrap::Bare);
        self.push(FieldDraft { spec, chart, wrap, u: None, is_level: true, rule: self.applied })
    }

    fn push(&mut self, made: FieldDraft) -> Result<()> {
        if self.made.len() >= MAX_FIELDS {
            return Err(failed!("the rules make over {MAX_FIELDS} fields; make fewer"));
        }
        self.index_of.insert(made.spec.name.clone(), self.made.len());
        self.made.push(made);
        Ok(())
    }
}
