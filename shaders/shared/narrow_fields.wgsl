// Fields that are not wide: each, and a quad of frames, by one invocation.

@compute @workgroup_size(FIELDS_GROUP)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    // A group takes a block's quads of as many fields as it has room for; groups side by side take other fields of the
    // same block, which so stays in the cache.
    let row = (group_number(group, groups) * FIELDS_GROUP + local) >> batch.lanes_log2;
    let quad = (group.y << batch.lanes_log2) + (local & (lanes() - 1u));
    if row >= arrayLength(&fields) || quad >= quads() {
        return;
    }
    let field = fields[row];
    let end = field.first + field.count;
    let first = at(0u, quad);
    let charted = is_charted(field);
    let touch = touch_of(field.first, end, 1u, first, charted);
    let found = found_of(field, touch.sums, touch.place);
    store_sums(field.index, quad, touch.sums, found.place);
    var spread = Spread(nobody_far(), no_moments());
    if charted {
        spread = spread_of(field.first, end, 1u, first, found);
    }
    finish_lines(field.index, quad, found, spread.far, spread.moments);
}
