@group(0) @binding(2) var<storage, read> members: array<Member>;

fn member_at(m: u32) -> Member {
    return members[m];
}
