/* Runs a sketch for as many of its loops as the argument says. */
#include <stdlib.h>

#include "Arduino.h"

uint32_t now_us;
int levels[32];
Port Serial;

void setup();
void loop();

int main(int count, char **arguments) {
  setup();
  for (long loops = count > 1 ? atol(arguments[1]) : 1; loops > 0; loops--) loop();
  return 0;
}
