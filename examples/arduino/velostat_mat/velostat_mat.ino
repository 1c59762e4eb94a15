// A mat of 16 × 16 sensors: a sheet of Velostat between 16 strips of copper tape in rows and 16 in columns.
//
// Wiring: a multiplexer CD74HC4067 connects one row at a time to 5 V, another one column at a time to A0; 10 kΩ from A0 to GND.
// Address pins of the rows' multiplexer S0..S3 are 2..5, those of the columns' 6..9; both EN to GND, SIG of the rows to 5 V, SIG
// of the columns to A0.
//
// A frame is 16 lines, the rows, and a blank line. Read it with:
//   somatic run --source text:/dev/ttyUSB0@500000 --pitch 20mm

const int ROWS = 16, COLUMNS = 16;
const int ROW_PINS[4] = {2, 3, 4, 5};
const int COLUMN_PINS[4] = {6, 7, 8, 9};
const int SETTLE_US = 20;  // until the voltage after a switch is steady

void choose(const int pins[4], int channel) {
  for (int bit = 0; bit < 4; bit++) digitalWrite(pins[bit], (channel >> bit) & 1 ? HIGH : LOW);
}

void setup() {
  for (int bit = 0; bit < 4; bit++) {
    pinMode(ROW_PINS[bit], OUTPUT);
    pinMode(COLUMN_PINS[bit], OUTPUT);
  }
  Serial.begin(500000);
}

void loop() {
  for (int row = 0; row < ROWS; row++) {
    choose(ROW_PINS, row);
    for (int column = 0; column < COLUMNS; column++) {
      choose(COLUMN_PINS, column);
      delayMicroseconds(SETTLE_US);
      if (column > 0) Serial.print(',');
      Serial.print(analogRead(A0));
    }
    Serial.println();
  }
  Serial.println();
}
