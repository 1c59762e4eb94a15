#include "somatic_wire.h"

enum { VERSION = 1 };

/* CRC-32 (Ethernet, zlib), four bits at a time: a table of 64 bytes. */
static uint32_t crc(uint32_t crc, uint8_t byte)
{
    static const uint32_t table[16] = {
        0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4, 0x4DB26158, 0x5005713C,
        0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C, 0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C,
    };
    crc ^= byte;
    crc = (crc >> 4) ^ table[crc & 15];
    return (crc >> 4) ^ table[crc & 15];
}

/* A packet being written: `code` is where the running COBS block keeps its length. */
struct packet {
    uint8_t *line;
    size_t length, code;
    uint32_t crc;
    int full;
};

static void block(struct packet *p)
{
    p->code = p->length++;
    p->line[p->code] = 1;
}

static void stuff(struct packet *p, uint8_t byte)
{
    /* A block of 254 needs another after it only if something follows. */
    if (p->full) {
        p->full = 0;
        block(p);
    }
    if (byte == 0) {
        block(p);
    } else {
        p->line[p->length++] = byte;
        p->full = ++p->line[p->code] == 255;
    }
}

static void put8(struct packet *p, uint8_t byte)
{
    p->crc = crc(p->crc, byte);
    stuff(p, byte);
}

static void put16(struct packet *p, uint16_t value)
{
    put8(p, (uint8_t)value);
    put8(p, (uint8_t)(value >> 8));
}

static void put32(struct packet *p, uint32_t value)
{
    put16(p, (uint16_t)value);
    put16(p, (uint16_t)(value >> 16));
}

static void begin(struct packet *p, uint8_t *line, uint8_t kind, const struct somatic_head *head)
{
    p->line = line;
    p->length = 0;
    p->crc = 0xFFFFFFFF;
    p->full = 0;
    line[p->length++] = 0;
    block(p);
    put8(p, VERSION);
    put8(p, kind);
    put16(p, head->board);
    put8(p, head->boot);
    put32(p, head->sequence);
    put32(p, head->time_us);
}

static size_t end(struct packet *p)
{
    uint32_t sum = ~p->crc;
    int i;
    for (i = 0; i < 4; i++)
        stuff(p, (uint8_t)(sum >> (8 * i)));
    p->line[p->length++] = 0;
    return p->length;
}

/* Values one after the other, each lowest bit first; `changed` may be null. */
static void put_values(struct packet *p, uint8_t bits, const uint16_t *values, const uint8_t *changed, size_t count)
{
    uint32_t waiting = 0;
    unsigned have = 0;
    size_t i;
    for (i = 0; i < count; i++) {
        if (changed && !changed[i])
            continue;
        waiting |= (uint32_t)values[i] << have;
        for (have += bits; have >= 8; have -= 8) {
            put8(p, (uint8_t)waiting);
            waiting >>= 8;
        }
    }
    if (have > 0)
        put8(p, (uint8_t)waiting);
}

size_t somatic_frame(uint8_t *line, const struct somatic_head *head, uint8_t bits, const uint16_t *values, size_t count)
{
    struct packet p;
    begin(&p, line, SOMATIC_FRAME, head);
    put8(&p, bits);
    put_values(&p, bits, values, NULL, count);
    return end(&p);
}

size_t somatic_partial(uint8_t *line, const struct somatic_head *head, uint8_t bits, const uint16_t *values,
                       const uint8_t *changed, size_t count)
{
    struct packet p;
    size_t i;
    while (count > 0 && !changed[count - 1])
        count--;
    begin(&p, line, SOMATIC_PARTIAL, head);
    put8(&p, bits);
    put8(&p, (uint8_t)((count + 7) / 8));
    for (i = 0; i < count; i += 8) {
        uint8_t byte = 0;
        size_t bit;
        for (bit = 0; bit < 8 && i + bit < count; bit++)
            if (changed[i + bit])
                byte |= (uint8_t)(1u << bit);
        put8(&p, byte);
    }
    put_values(&p, bits, values, changed, count);
    return end(&p);
}

size_t somatic_say_identity(uint8_t *line, const struct somatic_head *head, const struct somatic_identity *identity)
{
    struct packet p;
    size_t i;
    begin(&p, line, SOMATIC_IDENTITY, head);
    put8(&p, identity->request);
    put8(&p, identity->running ? 1 : 0);
    put16(&p, identity->channels);
    put8(&p, identity->bits);
    put32(&p, identity->layout);
    put32(&p, identity->rate_mhz);
    for (i = 0; i < 64 && identity->firmware[i]; i++)
        put8(&p, (uint8_t)identity->firmware[i]);
    return end(&p);
}

size_t somatic_answer(uint8_t *line, const struct somatic_head *head, uint8_t request, uint8_t command, uint8_t status,
                      uint32_t value)
{
    struct packet p;
    begin(&p, line, SOMATIC_ANSWER, head);
    put8(&p, request);
    put8(&p, command);
    put8(&p, status);
    put32(&p, value);
    return end(&p);
}

static uint32_t read32(const uint8_t *bytes)
{
    return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static int understand(const uint8_t *bytes, size_t length, struct somatic_command *command)
{
    uint32_t sum = 0xFFFFFFFF;
    size_t i;
    if (length < 9)
        return 0;
    for (i = 0; i < length - 4; i++)
        sum = crc(sum, bytes[i]);
    if (~sum != read32(bytes + length - 4) || bytes[0] != VERSION || bytes[1] < SOMATIC_IDENTIFY)
        return 0;
    command->kind = bytes[1];
    command->board = (uint16_t)(bytes[2] | bytes[3] << 8);
    command->request = bytes[4];
    if (command->kind == SOMATIC_RATE) {
        command->rate_mhz = read32(bytes + 5);
        return length == 13;
    }
    if (command->kind == SOMATIC_WIPER) {
        command->channel = (uint16_t)(bytes[5] | bytes[6] << 8);
        command->wiper = bytes[7];
        return length == 12;
    }
    return length == 9 || command->kind > SOMATIC_STOP;
}

static void keep(struct somatic_ear *ear, uint8_t byte)
{
    if (ear->length == SOMATIC_COMMAND)
        ear->bad = 1;
    else
        ear->bytes[ear->length++] = byte;
}

int somatic_hear(struct somatic_ear *ear, uint8_t byte, struct somatic_command *command)
{
    if (byte == 0) {
        int whole = !ear->bad && ear->left == 0 && understand(ear->bytes, ear->length, command);
        ear->length = ear->block = ear->left = ear->bad = 0;
        return whole;
    }
    if (ear->left == 0) {
        /* A length: the zero that the block before stands for comes first. */
        if (ear->block != 0 && ear->block != 255)
            keep(ear, 0);
        ear->block = byte;
        ear->left = (uint8_t)(byte - 1);
    } else {
        ear->left--;
        keep(ear, byte);
    }
    return 0;
}
