// What passes between the page and the desktop: files go to the server as their bytes, texts come for the clipboard and go from it.
'use strict'

const LINGER = 5000 // ms that a line stays
const MOST_PASTED = 4000 // characters
const MEBI = 1048576

const input = document.getElementById('file')
const line = document.getElementById('line')
const dialog = document.getElementById('copying')
const text = document.getElementById('text')

let key = null // of the window that steers
let most = 0 // bytes
let sending = null // the request that is under way
let fading = null
let wanted = '' // what the chosen file is for

function say (words, stays = false) {
  clearTimeout(fading)
  line.textContent = words
  if (words && !stays) fading = setTimeout(() => { line.textContent = '' }, LINGER)
}

// A message of the server that is not rendercanvas'; false for others.
export function told (message) {
  if (message.type === 'key') {
    key = message.value
    most = message.most
  } else if (message.type === 'clipboard') {
    copy(message.value)
  } else if (message.type === 'choose') {
    wanted = message.cookie ? 'cookie' : ''
    choose()
  } else if (message.type === 'download') {
    keep(message)
  } else {
    return false
  }
  return true
}

export function stopped () {
  key = null
  if (sending !== null) sending.abort()
}

// ----- files

function choose () {
  try {
    input.showPicker()
  } catch { // the click that asked for it is too long ago
    say('The browser did not open its file dialog: press Open again, or drop a file here')
  }
}

function keep (message) {
  const link = document.createElement('a')
  link.href = message.value
  link.download = message.name
  link.click()
  say(`${message.name} goes to the browser's downloads`)
}

function send (files, purpose = '') {
  if (files.length === 0) return
  const file = files[0]
  if (key === null) return say('Watching: only the window that steers opens files')
  if (sending !== null) return say('Another file is on its way')
  if (file.size > most) return say(`${file.name}: has ${Math.round(file.size / MEBI)} MiB; at most ${most / MEBI} MiB can be sent`)
  const first = files.length > 1 ? `, the first of ${files.length} files` : ''
  const request = sending = new XMLHttpRequest()
  request.open('POST', 'file')
  request.setRequestHeader('X-Airlight-Key', key)
  request.setRequestHeader('X-File-Name', encodeURIComponent(file.name.toWellFormed?.() ?? file.name))
  request.setRequestHeader('X-Airlight-For', purpose)
  request.setRequestHeader('Content-Type', 'application/octet-stream')
  const show = part => say(`Sending ${file.name}${first}: ${Math.floor(100 * part)} %`, true)
  request.upload.onprogress = event => show(event.total ? event.loaded / event.total : 0)
  request.onload = () => say(request.status === 200 ? (first && `${file.name} is shown${first}`) : request.responseText.trim())
  request.onerror = () => say(`${file.name} could not be sent; is it a folder, or has the connection gone?`)
  request.onloadend = () => { sending = null }
  show(0)
  request.send(file)
}

input.addEventListener('change', () => {
  send([...input.files], wanted)
  input.value = '' // the same file may be chosen again
})

const hasFiles = event => [...(event.dataTransfer?.types ?? [])].includes('Files')
for (const kind of ['dragenter', 'dragover', 'dragleave', 'drop']) {
  window.addEventListener(kind, event => {
    if (!hasFiles(event)) return
    event.preventDefault() // or the browser would show the file instead of this page
    const leaves = kind === 'drop' || (kind === 'dragleave' && event.relatedTarget === null)
    document.body.classList.toggle('dropping', !leaves)
    if (kind === 'drop') send([...event.dataTransfer.files])
  })
}

// ----- the clipboard

async function copy (value) {
  try {
    await navigator.clipboard.writeText(value) // is there where the page is secure, as it is on this machine or behind a tunnel
    say('Copied')
  } catch {
    text.value = value
    if (!dialog.open) dialog.showModal()
    text.select()
  }
}

document.getElementById('copy').onclick = () => {
  text.select()
  if (document.execCommand('copy')) {
    dialog.close()
    say('Copied')
  }
}
document.getElementById('close').onclick = () => dialog.close()

// The text comes before the key that pastes it: see view.js.
export function onPaste (then) {
  document.addEventListener('paste', event => {
    if (dialog.open) return
    event.preventDefault()
    then(event.clipboardData.getData('text/plain').slice(0, MOST_PASTED))
  })
}
