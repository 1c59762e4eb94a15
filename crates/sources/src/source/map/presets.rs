//! Maps by name, for hands and programs whose messages are described in public.

/// A map that comes with the program.
pub(super) struct Preset {
    name: &'static str,
    pub(super) map: &'static str,
    /// The definition of its messages, for bags that have none.
    pub(super) definition: Option<&'static str>,
    /// What people should know when they use it.
    pub(super) notes: &'static [&'static str],
    /// Whether its format is public, but no bytes of the hardware are.
    pub(super) is_untested: bool,
    /// As [`super::array_map::ArrayMap`] has it.
    pub(super) skin_axes: Option<&'static str>,
}

const DEX3: &str = r#"
type = "unitree_hg/msg/HandState"
values = "press_sensor_state[*].pressure"
missing = [30000]
pads = [
  { name = "pad_0", grid = "3x4", pitch = "4mm", at_mm = [-24, 20] },
  { name = "pad_1", grid = "3x4", pitch = "4mm", at_mm = [0, 20] },
  { name = "pad_2", grid = "3x4", pitch = "4mm", at_mm = [24, 20] },
  { name = "pad_3", grid = "3x4", pitch = "4mm", at_mm = [-24, 0] },
  { name = "pad_4", grid = "3x4", pitch = "4mm", at_mm = [0, 0] },
  { name = "pad_5", grid = "3x4", pitch = "4mm", at_mm = [24, 0] },
  { name = "pad_6", grid = "3x4", pitch = "4mm", at_mm = [-24, -20] },
  { name = "pad_7", grid = "3x4", pitch = "4mm", at_mm = [0, -20] },
  { name = "pad_8", grid = "3x4", pitch = "4mm", at_mm = [24, -20] },
]
"#;

/// What the values are behind comes first in a message; what follows them is not read, and is left out.
const HAND_STATE: &str = "\
MotorState[] motor_state
PressSensorState[] press_sensor_state
================================================================================
MSG: unitree_hg/MotorState
uint8 mode
float32 q
float32 dq
float32 ddq
float32 tau_est
int16[2] temperature
float32 vol
uint32[2] sensor
uint32 motorstate
uint32[4] reserve
================================================================================
MSG: unitree_hg/PressSensorState
float32[12] pressure
float32[12] temperature
uint32 lost
uint32 reserve
";

const TACTILE_STATE: &str = r#"
type = "tactile_msgs/msg/TactileState"
values = "sensors[*].values"
names = "sensors[*].name"
time = "header.stamp"
"#;

const TACTILE_STATE_DEFINITION: &str = "\
std_msgs/Header header
sensor_msgs/ChannelFloat32[] sensors
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: sensor_msgs/ChannelFloat32
string name
float32[] values
";

const MUJOCO: &str = r#"
values = "sensordata"
time = "time:s"
"#;

/// A `touch_grid` gives all forces along its site's z, then along x, then along y, and looks along −z. A taxel's tangent is the site's x,
/// so that n × t is −y.
const TOUCH_GRID_AXES: &str = "n,u,-v";

/// The names are those of the DDS messages of the maker's SDK, `inspire_hand_sdk`, and so are the registers, which it reads over Modbus
/// TCP: addresses count bytes, so that the nine registers from 3000 on are followed by those from 3018 on.
const INSPIRE: &str = r#"
values = [
  "fingerone_tip_touch", "fingerone_top_touch", "fingerone_palm_touch",
  "fingertwo_tip_touch", "fingertwo_top_touch", "fingertwo_palm_touch",
  "fingerthree_tip_touch", "fingerthree_top_touch", "fingerthree_palm_touch",
  "fingerfour_tip_touch", "fingerfour_top_touch", "fingerfour_palm_touch",
  "fingerfive_tip_touch", "fingerfive_top_touch", "fingerfive_middle_touch", "fingerfive_palm_touch",
  "palm_touch",
]
pads = [
  { name = "little_tip", grid = "3x3", pitch = "2mm", at_mm = [40, 100] },
  { name = "little_nail", grid = "12x8", pitch = "2mm", at_mm = [40, 80] },
  { name = "little_pad", grid = "10x8", pitch = "2mm", at_mm = [40, 50] },
  { name = "ring_tip", grid = "3x3", pitch = "2mm", at_mm = [20, 100] },
  { name = "ring_nail", grid = "12x8", pitch = "2mm", at_mm = [20, 80] },
  { name = "ring_pad", grid = "10x8", pitch = "2mm", at_mm = [20, 50] },
  { name = "middle_tip", grid = "3x3", pitch = "2mm", at_mm = [0, 100] },
  { name = "middle_nail", grid = "12x8", pitch = "2mm", at_mm = [0, 80] },
  { name = "middle_pad", grid = "10x8", pitch = "2mm", at_mm = [0, 50] },
  { name = "index_tip", grid = "3x3", pitch = "2mm", at_mm = [-20, 100] },
  { name = "index_nail", grid = "12x8", pitch = "2mm", at_mm = [-20, 80] },
  { name = "index_pad", grid = "10x8", pitch = "2mm", at_mm = [-20, 50] },
  { name = "thumb_tip", grid = "3x3", pitch = "2mm", at_mm = [-50, 50] },
  { name = "thumb_nail", grid = "12x8", pitch = "2mm", at_mm = [-50, 30] },
  { name = "thumb_middle", grid = "3x3", pitch = "2mm", at_mm = [-50, 10] },
  { name = "thumb_pad", grid = "12x8", pitch = "2mm", at_mm = [-50, -15] },
  { name = "palm", grid = "14x8", pitch = "4mm", at_mm = [10, 10] },
]
[registers]
fingerone_tip_touch = [3000, 9]
fingerone_top_touch = [3018, 96]
fingerone_palm_touch = [3210, 80]
fingertwo_tip_touch = [3370, 9]
fingertwo_top_touch = [3388, 96]
fingertwo_palm_touch = [3580, 80]
fingerthree_tip_touch = [3740, 9]
fingerthree_top_touch = [3758, 96]
fingerthree_palm_touch = [3950, 80]
fingerfour_tip_touch = [4110, 9]
fingerfour_top_touch = [4128, 96]
fingerfour_palm_touch = [4320, 80]
fingerfive_tip_touch = [4480, 9]
fingerfive_top_touch = [4498, 96]
fingerfive_middle_touch = [4690, 9]
fingerfive_palm_touch = [4708, 96]
palm_touch = [4900, 112]
"#;

/// As the reader of the maker, `xela_server_ros2`, takes the lines of its server apart: by sensor, three numbers for each taxel.
const XELA: &str = r#"
values = "[*].calibrated"
axes = "uvn"
grid = "4x4"
pitch = "4.7mm"
"#;

const XELA_ROS2: &str = r#"
type = "xela_server_ros2/msg/SensStream"
values = ["sensors[*].forces[*].x", "sensors[*].forces[*].y", "sensors[*].forces[*].z"]
axes = "u,v,n"
grid = "4x4"
pitch = "4.7mm"
"#;

/// As the documentation of `xela_server_ros2` has it; counts go up to 65535 there, so that they are unsigned.
const XELA_DEFINITION: &str = "\
SensorFull[] sensors
================================================================================
MSG: xela_server_ros2/SensorFull
uint32 message
float64 time
string model
uint8 sensor_pos
Taxel[] taxels
Forces[] forces
================================================================================
MSG: xela_server_ros2/Taxel
uint16 x
uint16 y
uint16 z
================================================================================
MSG: xela_server_ros2/Forces
float32 x
float32 y
float32 z
";

/// The names are those of the maker's manual; sources differ about what is before them, so that messages have to define themselves.
const CONTACTILE: &str = r#"
values = ["pillars[*].fx", "pillars[*].fy", "pillars[*].fz"]
axes = "u,v,n"
grid = "3x3"
pitch = "7mm"
"#;

/// What a board's frames hold is known without paths.
const PAXINI: &str = r#"
values = "taxels"
axes = "uvn"
scale = 0.1
pitch = "2mm"
"#;

const UNMEASURED_AXES: &str =
    "x is taken for right and y for up on the pad, as drawn; drag over it, and correct `axes` in a map of your own";

const XELA_GRIDS: &str =
    "sensors of XELA are taken to have 4 × 4 taxels each, drawn 4.7 mm apart; others need a map of your own";

const PRESETS: [Preset; 8] = [
    Preset {
        name: "dex3",
        map: DEX3,
        definition: Some(HAND_STATE),
        notes: &[
            "the pads of a Dex3-1 are drawn in a 3 × 3 arrangement, not measured",
            "public sources differ about the Dex3-1: its manual has 6 pads of 3 × 4, its SDK 9; none lists their order",
        ],
        is_untested: true,
        skin_axes: None,
    },
    Preset {
        name: "tactile-state",
        map: TACTILE_STATE,
        definition: Some(TACTILE_STATE_DEFINITION),
        notes: &[],
        is_untested: false,
        skin_axes: None,
    },
    Preset {
        name: "mujoco",
        map: MUJOCO,
        definition: None,
        notes: &[],
        is_untested: false,
        skin_axes: Some(TOUCH_GRID_AXES),
    },
    Preset {
        name: "inspire",
        map: INSPIRE,
        definition: None,
        notes: &[
            "the pads of an Inspire RH56 are drawn side by side, not measured",
            "public sources differ about the palm of an Inspire RH56: 14 × 8 here, 8 × 14 in others; none lists how its pads lie",
        ],
        is_untested: true,
        skin_axes: None,
    },
    Preset {
        name: "xela",
        map: XELA,
        definition: None,
        notes: &[
            XELA_GRIDS,
            "values are the calibrated forces; counts are at [*].data, with decoder = \"hex16\"",
            UNMEASURED_AXES,
        ],
        is_untested: true,
        skin_axes: None,
    },
    Preset {
        name: "xela-ros2",
        map: XELA_ROS2,
        definition: Some(XELA_DEFINITION),
        notes: &[XELA_GRIDS, UNMEASURED_AXES],
        is_untested: true,
        skin_axes: None,
    },
    Preset {
        name: "contactile",
        map: CONTACTILE,
        definition: None,
        notes: &[
            "the nine pillars of a Contactile PapillArray are drawn 7 mm apart, row by row; its manual says that pillar 4 is in the middle",
            "public sources differ about the messages of a PapillArray (a header, ids of 32 or 64 bits), so they have to be defined: by the \
             bag, or by `definition` in a map",
            UNMEASURED_AXES,
        ],
        is_untested: true,
        skin_axes: None,
    },
    Preset {
        name: "paxini",
        map: PAXINI,
        definition: None,
        notes: &[
            "values are in N; the taxels of each sensor of PaXini are drawn in a row, 2 mm apart, not measured",
            UNMEASURED_AXES,
        ],
        is_untested: true,
        skin_axes: None,
    },
];

/// The preset called `name`.
pub(super) fn find(name: &str) -> Option<&'static Preset> {
    PRESETS.iter().find(|preset| preset.name == name)
}

/// The names of all presets.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|preset| preset.name)
}
