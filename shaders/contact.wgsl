// contact: sums over a field, one invocation a field and frame (src/stage/contact.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> taxels: array<Taxel>;
@group(0) @binding(2) var<storage, read> fields: array<Field>;
@group(0) @binding(3) var<storage, read> members: array<Member>;
@group(0) @binding(4) var<storage, read> pressures: array<f32>;
@group(0) @binding(5) var<storage, read> statuses: array<u32>;
@group(0) @binding(6) var<storage, read_write> cells: array<u32>;
// total, peak, area, and the bits of the number of pressed taxels
@group(0) @binding(7) var<storage, read_write> contacts: array<vec4<f32>>;

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
    let frame = cell % batch.frames;
    var total = 0.0;
    var peak = 0.0;
    var area = 0.0;
    var pressed = 0u;
    var usable = false;
    var flags = 0u;
    for (var m = field.first; m < field.first + field.count; m++) {
        let member = members[m];
        let at = member.slot * batch.frames + frame;
        let pressure = pressures[at];
        let status = statuses[at];
        flags |= status;
        usable |= (status & UNUSABLE) == 0u;
        total += member.weight * pressure;
        peak = max(peak, pressure);
        if pressure > 0.0 {
            pressed += 1u;
            area += taxels[member.slot].area;
        }
    }
    flags &= FLAGS;
    flags |= select(NO_CONTACT, 0u, pressed > 0u);
    flags |= select(NO_CHART, 0u, field.charted != 0u);
    var present = 0u;
    if usable {
        present = TOTAL | PEAK | ACTIVE | select(0u, AREA, field.area_known != 0u);
    }
    cells[cell] = flags | (present << PRESENT);
    contacts[cell] = vec4<f32>(total, peak, area, bitcast<f32>(pressed));
}
