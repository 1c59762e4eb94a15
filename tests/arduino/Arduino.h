/* What the sketches of examples/arduino use of an Arduino, on a computer: what they send goes to standard output, and time goes on
 * as they wait. */
#ifndef ARDUINO_H
#define ARDUINO_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { LOW = 0, HIGH = 1, INPUT = 0, OUTPUT = 1 };
enum { A0 = 14, A1, A2, A3, A4, A5 };

extern uint32_t now_us;
extern int levels[32];

inline unsigned long micros() { return now_us += 7; }
inline unsigned long millis() { return micros() / 1000; }
inline void delay(unsigned long ms) { now_us += ms * 1000; }
inline void delayMicroseconds(unsigned us) { now_us += us; }
inline void pinMode(int, int) {}
inline void digitalWrite(int pin, int level) { levels[pin] = level; }

/* The pin's number, or what the multiplexers of the mat connect to it: 100 times the row, and the column. */
inline int analogRead(int pin) {
  now_us += 100;
  int row = 0, column = 0;
  for (int bit = 0; bit < 4; bit++) {
    row |= levels[2 + bit] << bit;
    column |= levels[6 + bit] << bit;
  }
  return row + column > 0 || pin != A0 ? 60 * row + column + (pin - A0) : 0;
}

struct Port {
  void begin(unsigned long) {}
  int available() { return 0; }
  int read() { return -1; }
  void print(int value) { printf("%d", value); }
  void print(char value) { putchar(value); }
  void print(const char *value) { fputs(value, stdout); }
  void println() { fputs("\r\n", stdout); }
  void println(int value) { printf("%d\r\n", value); }
  void println(const char *value) { printf("%s\r\n", value); }
  size_t write(const uint8_t *bytes, size_t length) { return fwrite(bytes, 1, length, stdout); }
};
extern Port Serial;

#endif
