//! What sinks and recordings call the fields of a plan.

use somatic::Plan;
use somatic::sink::FieldNames;

/// The names of the fields of `plan`, in their order.
pub(super) fn field_names(plan: &Plan) -> Vec<FieldNames> {
    let name = |(index, (field, link)): (usize, (&str, &str))| {
        let mark = plan.mark(index);
        FieldNames {
            field: field.into(),
            link: link.into(),
            letter: mark.receptor.map(|receptor| receptor.to_string()),
            signal: mark.signal.map(|signal| signal.to_string()),
        }
    };
    plan.fields().enumerate().map(name).collect()
}
