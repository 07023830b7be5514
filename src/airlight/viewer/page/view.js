// The page of the browser view: frames come over a websocket, events go back. It speaks the protocol of rendercanvas' remote view;
// renderview.js, which comes with rendercanvas, turns the browser's events into its own.
'use strict'

import { onPaste, stopped, told as toldFiles } from './files.js'

const SENT = new Set(['pointer_down', 'pointer_up', 'pointer_move', 'pointer_enter', 'pointer_leave', 'double_click', 'wheel',
  'key_down', 'key_up', 'char'])
const THROTTLE = 20 // ms
const FIRST_RETRY = 500, LAST_RETRY = 5000 // ms between attempts to connect

const picture = document.getElementById('picture')
const status = document.getElementById('status')
let socket = null
let retry = FIRST_RETRY
let size = null // the last resize event
let next = null // the last frame that arrived, not yet shown
let header = null // of the frame whose bytes come next
let busy = false // while a picture is being shown

const now = () => performance.now() / 1000

function send (message) {
  if (socket !== null && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message))
}

// Moves and turns of the wheel are many: those within some ms are sent as one, and before whatever comes next. (renderview.js' own throttle
// would send the last move of a drag after the button is up.)
let held = null

function release () {
  if (held !== null) send(held)
  held = null
}

function hold (event) {
  const same = held !== null && ['type', 'buttons', 'modifiers'].every(name => String(held[name]) === String(event[name]))
  if (!same) release()
  if (held === null) setTimeout(release, THROTTLE)
  held = event.type === 'wheel' && same ? { ...event, dx: held.dx + event.dx, dy: held.dy + event.dy } : event
}

let pasting = null // the key that pastes, until it is known what

class View extends window.BaseRenderView {
  onEvent (event) {
    if (event.type === 'key_down' && event.key.toLowerCase() === 'v' && event.modifiers.some(name => name === 'Control' || name === 'Meta')) {
      pasting = event
    } else if (event.type === 'pointer_move' || event.type === 'wheel') {
      hold(event)
    } else if (SENT.has(event.type)) {
      release()
      send(event)
    }
  }
}

onPaste(text => {
  if (pasting === null) return
  send({ type: 'paste', text, timestamp: now() })
  send(pasting)
  pasting = null
})

// Full window; sizes are inline, or renderview.js would choose its own.
Object.assign(picture.style, { width: '100vw', height: '100vh' })
picture.ondragstart = () => false
const view = new View(picture, null)
view.setThrottle(0)

// Pixels of the screen, also where the window moves to a screen of another density, which renderview.js does not notice.
const observer = new ResizeObserver(entries => {
  const entry = entries[entries.length - 1]
  const ratio = window.devicePixelRatio
  const exact = entry.devicePixelContentBoxSize?.[0]
  const pixels = (points, found) => { // found is not there in every browser, and knows nothing of an emulated density
    const near = points * ratio
    return found !== undefined && Math.abs(found - near) < 2 ? found : Math.round(near)
  }
  const pwidth = pixels(entry.contentRect.width, exact?.inlineSize)
  const pheight = pixels(entry.contentRect.height, exact?.blockSize)
  if (!pwidth || !pheight) return
  size = { type: 'resize', width: pwidth / ratio, height: pheight / ratio, pwidth, pheight, ratio, timestamp: now() }
  send(size)
})
try {
  observer.observe(picture, { box: 'device-pixel-content-box' })
} catch {
  observer.observe(picture)
}

// Keys go to renderview.js' hidden field.
const OURS = 'soyz' // with Ctrl: save the picture, not the page; open a file; undo
const focus = () => document.getElementById('copying').open || document.querySelector('#rendercanvas-focus-element-container input').focus({ preventScroll: true })
window.addEventListener('focus', focus)
window.addEventListener('keydown', event => {
  const bare = !event.altKey && !event.ctrlKey && !event.metaKey
  const ours = event.key.length === 1 && OURS.includes(event.key.toLowerCase()) && (event.ctrlKey || event.metaKey)
  if ((event.key === 'Tab' && bare && !document.getElementById('copying').open) || ours) event.preventDefault()
}, { capture: true })
focus()

// This frame and all before it.
function acknowledge (frame) {
  send({ type: '_framefeedback', index: frame.index, timestamp: frame.timestamp, localtime: Date.now() / 1000 })
}

function show () {
  busy = next !== null
  if (!busy) return
  const frame = next
  next = null
  acknowledge(frame)
  const old = picture.src
  picture.onload = picture.onerror = () => {
    if (old) URL.revokeObjectURL(old)
    requestAnimationFrame(show)
  }
  picture.src = URL.createObjectURL(new Blob([frame.data], { type: frame.mimetype }))
}

function arrived (frame) {
  next = frame
  if (document.hidden) acknowledge(frame) // nothing is drawn, and whoever watches elsewhere should not wait for this window
  if (!busy) {
    busy = true
    requestAnimationFrame(show)
  }
}

document.addEventListener('visibilitychange', () => {
  if (document.hidden && next !== null) acknowledge(next)
})

function told (message) {
  if (toldFiles(message)) return
  if (message.type === 'framebufferdata') {
    header = message
  } else if (message.type === 'active') {
    status.textContent = message.value ? '' : 'Watching: another window steers'
    if (message.value && size !== null) send(size)
  } else if (message.type === 'title') {
    document.title = message.value
  } else if (message.type === 'cursor') {
    view.setCursor(message.value)
  }
}

function connect () {
  const opened = new WebSocket(`ws://${location.host}/ws`)
  opened.binaryType = 'arraybuffer'
  opened.onopen = () => {
    socket = opened
    retry = FIRST_RETRY
    next = null
    header = null
    status.textContent = ''
    if (size !== null) send(size)
  }
  opened.onmessage = event => {
    if (typeof event.data === 'string') {
      told(JSON.parse(event.data))
    } else if (header !== null) {
      arrived({ ...header, data: event.data })
      header = null
    }
  }
  opened.onclose = event => {
    socket = null
    stopped()
    status.textContent = (event.reason ? `Disconnected: ${event.reason}. ` : 'Disconnected. ') + 'Trying again …'
    setTimeout(connect, retry)
    retry = Math.min(2 * retry, LAST_RETRY)
  }
}

connect()
