// A row of force-sensing resistors on the analogue pins of an Arduino, a line a frame: 512,300,7
//
// Wiring of each sensor: 5 V – sensor – pin – 10 kΩ – GND, so that the value rises with the force.
// Read it with:  somatic run --source text:/dev/ttyUSB0@115200

const int PINS[] = {A0, A1, A2, A3};
const int SENSORS = sizeof(PINS) / sizeof(PINS[0]);
const unsigned long PERIOD_MS = 10;  // 100 frames a second

unsigned long nextMs = 0;

void setup() {
  Serial.begin(115200);
  nextMs = millis();
}

void loop() {
  if ((long)(millis() - nextMs) < 0) return;
  nextMs += PERIOD_MS;
  for (int sensor = 0; sensor < SENSORS; sensor++) {
    if (sensor > 0) Serial.print(',');
    Serial.print(analogRead(PINS[sensor]));
  }
  Serial.println();
}
