// Where all of a share's memberships fit into what every device can bind as a uniform: those are read once for a whole group.
@group(0) @binding(2) var<uniform> members: array<Member, 4096>;

fn member_at(m: u32) -> Member {
    return members[m];
}
