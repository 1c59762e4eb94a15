// A board that speaks somatic's own protocol: packets with checksums, numbers and times, so that no loss goes unseen.
//
// Copy somatic_wire.c and somatic_wire.h from examples/firmware beside this sketch. Read it with:
//   somatic run --body BODY.glb --source serial:/dev/ttyUSB0@115200

#define SOMATIC_CHANNELS 16
#include "somatic_wire.h"

const uint16_t BOARD = 1;
const int PINS[] = {A0, A1, A2, A3};
const int CHANNELS = sizeof(PINS) / sizeof(PINS[0]);
const uint8_t BITS = 10;

somatic_head head;
somatic_ear ear;
uint8_t line[SOMATIC_LINE];
uint32_t rateMilliHz = 100000;
bool isRunning = true;
uint32_t lastUs = 0;

void sayIdentity(uint8_t request) {
  somatic_identity identity = {request, isRunning, CHANNELS, BITS, 0, rateMilliHz, "arduino 1"};
  Serial.write(line, somatic_say_identity(line, &head, &identity));
}

void obey(const somatic_command &command) {
  if (command.board != BOARD && command.board != SOMATIC_ANY_BOARD) return;
  uint8_t status = SOMATIC_DONE;
  uint32_t value = 0;
  head.time_us = micros();
  switch (command.kind) {
    case SOMATIC_IDENTIFY: sayIdentity(command.request); return;
    case SOMATIC_RATE: value = rateMilliHz = command.rate_mhz; break;
    case SOMATIC_START: isRunning = true; break;
    case SOMATIC_STOP: isRunning = false; break;
    default: status = SOMATIC_UNKNOWN;
  }
  Serial.write(line, somatic_answer(line, &head, command.request, command.kind, status, value));
}

void setup() {
  Serial.begin(115200);
  head.board = BOARD;
  // Another number after each start: the noise of a pin to which nothing is connected.
  for (int bit = 0; bit < 8; bit++) head.boot = (head.boot << 1) | (analogRead(A5) & 1);
  lastUs = head.time_us = micros();
  sayIdentity(0);
}

void loop() {
  somatic_command command;
  while (Serial.available() > 0) {
    if (somatic_hear(&ear, (uint8_t)Serial.read(), &command)) obey(command);
  }
  // 10^9 / mHz is the period in microseconds; 0 sends as many frames as the line takes.
  const uint32_t periodUs = rateMilliHz > 0 ? 1000000000UL / rateMilliHz : 0;
  if (!isRunning || micros() - lastUs < periodUs) return;
  lastUs = head.time_us = micros();
  uint16_t values[CHANNELS];
  for (int channel = 0; channel < CHANNELS; channel++) values[channel] = analogRead(PINS[channel]);
  Serial.write(line, somatic_frame(line, &head, BITS, values, CHANNELS));
  head.sequence++;
}
