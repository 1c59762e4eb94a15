// How a stage goes over the fields: each field and frame by one invocation, or a wide field by a whole group.
//
// The stage declares `fields`, `cells` and `wide_fields`, and says what it adds up: a type `Part` with `nothing()`,
// `add(part, member, frame, context)`, `join(part, part)` and `finish(cell, field, part)`; `context_of(cell, field)` is
// what every member needs to be told.

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let cell = invocation(group, groups, local);
    if cell >= batch.frames * batch.fields {
        return;
    }
    let field = fields[cell / batch.frames];
    if field.count > WIDE {
        return;
    }
    let context = context_of(cell, field);
    var part = nothing();
    for (var m = field.first; m < field.first + field.count; m++) {
        part = add(part, m, cell % batch.frames, context);
    }
    finish(cell, field, part);
}

var<workgroup> parts: array<Part, GROUP>;

@compute @workgroup_size(GROUP)
fn wide(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let number = group_number(group, groups);
    if number >= batch.frames * batch.wide {
        return;
    }
    let index = wide_fields[number / batch.frames];
    let cell = index * batch.frames + number % batch.frames;
    let field = fields[index];
    let context = context_of(cell, field);
    var part = nothing();
    for (var m = field.first + local; m < field.first + field.count; m += GROUP) {
        part = add(part, m, cell % batch.frames, context);
    }
    parts[local] = part;
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            parts[local] = join(parts[local], parts[local + half]);
        }
    }
    if local == 0u {
        finish(cell, field, parts[0]);
    }
}
