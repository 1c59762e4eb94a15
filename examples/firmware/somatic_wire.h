/* The wire of somatic, version 1, for a board's firmware: C99, no allocation, no library but stdint and stddef.
 * docs/reference/wire.md specifies the format; docs/wire/vectors.json has packets to check against. */
#ifndef SOMATIC_WIRE_H
#define SOMATIC_WIRE_H

#include <stddef.h>
#include <stdint.h>

/* For sketches in C++, such as Arduino's: the functions are C. */
#ifdef __cplusplus
extern "C" {
#endif

/* Channels of a board; fewer need less memory. */
#ifndef SOMATIC_CHANNELS
#define SOMATIC_CHANNELS 256
#endif
/* Bytes of the longest packet on the line: head, bits, bitmap, values, checksum, COBS, a zero at both ends. */
#define SOMATIC_PLAIN (13 + 2 + SOMATIC_CHANNELS / 8 + 2 * SOMATIC_CHANNELS + 4)
#define SOMATIC_LINE (SOMATIC_PLAIN + SOMATIC_PLAIN / 254 + 1 + 2 + 64)
/* Bytes of the longest command before COBS. */
#define SOMATIC_COMMAND 13

enum { SOMATIC_ANY_BOARD = 0xFFFF };
enum somatic_kind {
    SOMATIC_FRAME = 0x01, SOMATIC_PARTIAL = 0x02, SOMATIC_IDENTITY = 0x03, SOMATIC_ANSWER = 0x04,
    SOMATIC_IDENTIFY = 0x10, SOMATIC_RATE = 0x11, SOMATIC_WIPER = 0x12, SOMATIC_START = 0x13, SOMATIC_STOP = 0x14
};
enum somatic_status { SOMATIC_DONE = 0, SOMATIC_UNKNOWN = 1, SOMATIC_BAD = 2, SOMATIC_FAILED = 3 };

struct somatic_head {
    uint16_t board;
    uint8_t boot;       /* another number after each start */
    uint32_t sequence;  /* of this frame, or of the next one */
    uint32_t time_us;
};

struct somatic_identity {
    uint8_t request, running;
    uint16_t channels;
    uint8_t bits;
    uint32_t layout, rate_mhz;
    const char *firmware;
};

/* Each writes a packet to `line`, which has room for SOMATIC_LINE bytes, and gives its length. */
size_t somatic_frame(uint8_t *line, const struct somatic_head *head, uint8_t bits, const uint16_t *values, size_t count);
/* `changed` has a byte a channel, 0 for those that are left out. */
size_t somatic_partial(uint8_t *line, const struct somatic_head *head, uint8_t bits, const uint16_t *values,
                       const uint8_t *changed, size_t count);
size_t somatic_say_identity(uint8_t *line, const struct somatic_head *head, const struct somatic_identity *identity);
size_t somatic_answer(uint8_t *line, const struct somatic_head *head, uint8_t request, uint8_t command, uint8_t status,
                      uint32_t value);

/* What the host asks. */
struct somatic_command {
    uint16_t board;
    uint8_t request, kind;
    uint32_t rate_mhz;  /* SOMATIC_RATE */
    uint16_t channel;   /* SOMATIC_WIPER */
    uint8_t wiper;      /* SOMATIC_WIPER */
};

/* What has been heard of a command; all zero at first. */
struct somatic_ear {
    uint8_t bytes[SOMATIC_COMMAND];
    uint8_t length, block, left, bad;
};

/* Takes one byte from the line; 1 when it ends a whole command, which is then in `command`. A command of a kind that
 * this version does not know is given, too, so that it can be answered. */
int somatic_hear(struct somatic_ear *ear, uint8_t byte, struct somatic_command *command);

#ifdef __cplusplus
}
#endif

#endif
