//! What viewers are sent of touches of the whole body: their values, their trails, and events.

use super::*;

/// With touches, and fields whose total alone is wanted.
fn bench() -> Bench {
    Bench::with_scene(Scene::default().outputs(Outputs::TOTAL).touches(touch::Options::default()), "")
}

/// Both links of the body where they are at rest, the arm moved by `x_m`.
fn pose(x_m: f64) -> Vec<(String, Pose)> {
    let at = |x: f64| Pose { translation: DVec3::new(x, 0.0, 0.0), rotation: DQuat::IDENTITY };
    vec![("arm".to_owned(), at(1.0 + x_m)), ("hand".to_owned(), at(2.0))]
}

fn sent(bench: &mut Bench, viewer: &mut Viewer) -> Value {
    let message = bench.send(viewer);
    viewer.drawn(u32::from_le_bytes(message[4..8].try_into().unwrap()), bench.arrived);
    decode_frame(&message, &bench.scene)
}

fn texts(bench: &mut Bench) -> Vec<String> {
    bench.publisher.flush();
    let (_, events) = bench.exchange.lock().log.after(0, 100);
    let said: Value = serde_json::from_str(&text::events(0, &events, &bench.scene.names)).unwrap();
    let events = said["events"].as_array().unwrap();
    events
        .iter()
        .map(|event| format!("{}: {}", event["kind"].as_str().unwrap(), event["text"].as_str().unwrap()))
        .collect()
}

#[test]
fn a_touch_is_sent_with_its_values_taxels_and_shares() {
    let (mut bench, mut viewer) = (bench(), Viewer::new(0));
    let welcome: Value = serde_json::from_str(&welcome(&bench.scene)).unwrap();
    assert_eq!(welcome["touches"], true);
    assert_eq!(welcome["touch_flags"][0], "one_taxel");
    // On the arm two taxels beside each other; on the hand one.
    let frame = bench.frame(0.0, [6.0, 2.0, 0.0, 5.0, 0.0]);
    bench.process(&[frame]);
    let touches = sent(&mut bench, &mut viewer)["touches"].clone();
    let expected = bench.engine.percepts().touches(0).unwrap().touches.clone();
    assert_eq!(touches.as_array().unwrap().len(), expected.len());
    assert_eq!(expected.len(), 2, "the links are not connected");
    for (touch, expected) in touches.as_array().unwrap().iter().zip(&expected) {
        assert_eq!((&touch["id"], &touch["link"]), (&expected.id.into(), &expected.link.into()));
        assert_eq!(touch["frame"], touch["link"], "no frame has a pose");
        assert_eq!((&touch["total"], &touch["peak"]), (&expected.total.into(), &expected.peak.into()));
        assert_eq!((&touch["active"], &touch["flags"]), (&expected.active.into(), &expected.flags.bits().into()));
        assert_eq!(touch["force"], Value::Null, "counts are not newtons");
        for axis in 0..3 {
            assert_eq!(touch["position"][axis].as_f64(), Some(f64::from(expected.position[axis] as f32)));
            assert_eq!(touch["normal"][axis].as_f64(), Some(f64::from(expected.normal[axis] as f32)));
        }
    }
    let on = |link: u32| touches.as_array().unwrap().iter().find(|touch| touch["link"] == link).unwrap();
    // By their places in the body.
    assert_eq!((&on(0)["taxels"], &on(1)["taxels"]), (&json!([0, 1]), &json!([3])));
    let share = |index: u32| json!({"index": index, "share": 1.0});
    assert_eq!(on(0)["links"], json!([share(0)]));
    assert_eq!((&on(0)["fields"], &on(1)["fields"]), (&json!([share(0), share(1)]), &json!([share(0), share(2)])));
    // Nothing is touched: they are gone, and that is sent once.
    let rest = bench.frame(0.01, [0.0; 5]);
    bench.process(&[rest]);
    assert_eq!(sent(&mut bench, &mut viewer)["touches"], json!([]));
    let rest = bench.frame(0.02, [0.0; 5]);
    bench.process(&[rest]);
    let rest = bench.frame(0.03, [0.0; 5]);
    bench.process(&[rest]);
    assert_eq!(sent(&mut bench, &mut viewer)["touches"], Value::Null);
}

#[test]
fn a_trail_leads_through_every_frame_and_ends_with_its_touch() {
    let (mut bench, mut viewer) = (bench(), Viewer::new(0));
    // From the first taxel to the second in two seconds, a hundred frames a second, ten a call.
    let values = |part: f64| [10.0 * (1.0 - part), 10.0 * part, 0.0, 0.0, 0.0];
    for call in 0..20 {
        let frames: Vec<Frame> = (10 * call..10 * (call + 1))
            .map(|i| bench.frame(0.01 * f64::from(i), values((f64::from(i) + 1.0) / 201.0)))
            .collect();
        bench.process(&frames);
    }
    let touches = sent(&mut bench, &mut viewer)["touches"].clone();
    let touch = &touches[0];
    assert_eq!(touches.as_array().unwrap().len(), 1);
    let trail = touch["trail"].as_array().unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let ages: Vec<f64> = trail.iter().map(|point| number(&point["ago"])).collect();
    assert!(ages.is_sorted_by(|a, b| a > b) && ages[0] <= 1.0 && ages[0] > 0.94, "{ages:?}");
    assert!((24..=34).contains(&ages.len()), "of viewers who see one frame too: {}", ages.len());
    // It moves along x, 10 mm in two seconds, by the areas of both cells not evenly.
    let places: Vec<f64> = trail.iter().map(|point| number(&point["position"][0])).collect();
    assert!(places.is_sorted(), "{places:?}");
    let way = number(&touch["position"][0]) - places[0];
    assert!(way > 0.002 && way < 0.01, "{way}");
    assert!(trail.iter().all(|point| point["frame"] == 0));
    // A jump back: what came later is not part of it. Frames on the way are passed through.
    let (state, again) = (bench.engine.percepts().clone(), bench.frame(1.0, values(0.5)));
    bench.publisher.pass(&state);
    bench.publisher.jump();
    bench.process(&[again]);
    let frame = sent(&mut bench, &mut viewer);
    let trail = frame["touches"][0]["trail"].as_array().unwrap();
    assert!(!trail.is_empty() && trail.iter().all(|point| number(&point["ago"]) >= 0.0), "{trail:?}");
}

#[test]
fn places_in_the_world_are_relative_to_the_pages_origin() {
    let (mut bench, mut viewer) = (bench(), Viewer::new(0));
    let origin = bench.scene.origin;
    let frame =
        |bench: &Bench, t_s: f64, x_m: f64| Frame { pose: pose(x_m), ..bench.frame(t_s, [6.0, 0.0, 0.0, 0.0, 0.0]) };
    let first = frame(&bench, 0.0, 0.0);
    bench.process(&[first]);
    let second = frame(&bench, 0.1, 0.5);
    bench.process(&[second]);
    let touch = sent(&mut bench, &mut viewer)["touches"][0].clone();
    assert_eq!((&touch["link"], &touch["frame"]), (&0.into(), &u32::MAX.into()));
    let x = |of: &Value| of["position"][0].as_f64().unwrap() + origin.x;
    assert!((x(&touch) - 1.51).abs() < 1e-6, "{touch}");
    let trail = touch["trail"].as_array().unwrap();
    assert_eq!(trail.len(), 2);
    assert!(trail[0]["frame"] == u32::MAX && (x(&trail[0]) - 1.01).abs() < 1e-6, "{touch}");
}

#[test]
fn events_are_of_touches_where_these_are_looked_for_and_else_of_fields() {
    let frames = |bench: &Bench| -> Vec<Frame> {
        let values = [[0.0; 5], [5.0, 0.0, 0.0, 0.0, 0.0], [5.0, 0.0, 0.0, 3.0, 0.0], [0.0, 0.0, 0.0, 3.0, 0.0]];
        values.iter().zip(0..).map(|(values, i)| bench.frame(0.01 * f64::from(i), *values)).collect()
    };
    let mut with = bench();
    let of_touches = frames(&with);
    with.process(&of_touches);
    assert_eq!(
        texts(&mut with),
        ["onset: touch 1 begins on arm", "onset: touch 2 begins on hand", "release: touch 1 ends on arm"]
    );
    // What is touched after a jump begins nothing.
    with.publisher.jump();
    let elsewhere = with.frame(9.0, [0.0, 0.0, 9.0, 0.0, 0.0]);
    with.process(&[elsewhere]);
    assert_eq!(texts(&mut with).len(), 3);
    let released = with.frame(9.01, [0.0; 5]);
    with.process(&[released]);
    assert_eq!(texts(&mut with).len(), 4);

    let mut without = Bench::new(Outputs::TOTAL, &ALL_LETTERS[..1], "");
    let of_fields = frames(&without);
    without.process(&of_fields);
    let said = texts(&mut without);
    assert!(said.contains(&"onset: all/arm is touched".to_owned()), "{said:?}");
    assert!(said.contains(&"release: all/arm is released".to_owned()), "{said:?}");
    let welcome: Value = serde_json::from_str(&welcome(&without.scene)).unwrap();
    assert_eq!(welcome["touches"], false);
    assert_eq!(sent(&mut without, &mut Viewer::new(0))["touches"], Value::Null);
}
